// SPDX-License-Identifier: MIT
#include "viewer/commands.h"

#include <algorithm>
#include <utility>

#include "engine/core/error.h"
#include "viewer/controls.h"
#include "viewer/guides.h"
#include "viewer/tools.h"

namespace darb {

namespace {

bool always(const Session&) {
    return true;
}
bool has_scene(const Session& s) {
    return s.scene != nullptr;
}
bool run_goes_on(const Session& s) {
    return s.training.live && !s.training.finished;
}
bool can_edit(const Session& s) {
    return s.scene && !s.edit.transforms();
}
bool has_selection(const Session& s) {
    return can_edit(s) && s.edit.selected_count() > 0;
}
bool can_remove(const Session& s) {
    return can_edit(s) &&
           (s.edit.selected_count() > 0 || s.selection.shown || s.tools.tool == Tool::measure ||
            (s.tools.tool == Tool::polygon && s.tools.drawing));
}
bool has_cameras(const Session& s) {
    return !s.photos.views.empty();
}
bool has_photo(const Session& s) {
    return s.photos.current >= 0 && !s.photos.view().photo.empty();
}

// From the free camera it steps to the first or the last one.
void step_camera(Session& s, bool next) {
    const int count = static_cast<int>(s.photos.views.size());
    if (count == 0) return;
    const int from = s.photos.current >= 0 ? s.photos.current : next ? count - 1 : 0;
    s.ask(request::ChooseCamera{(from + (next ? 1 : count - 1)) % count});
}

void play_or_pause(Session& s) {
    if (run_goes_on(s))
        s.training.paused = !s.training.paused;
    else
        s.path.playing = !s.path.playing && !s.path.path.keys.empty();
}

void step_training(Session& s) {
    if (!run_goes_on(s)) return;
    s.training.paused = true;
    ++s.training.steps_to_go;
}

// Removes the last corner or point of a polygon or a measurement that is under way, else the
// selection, or what is inside the box or sphere that is shown.
void remove_selected(Session& s) {
    if (drop_corner(s)) return;
    if (s.tools.tool == Tool::measure)
        drop_measured_point(s);
    else if (s.edit.selected_count() > 0)
        show_edit(s.edit.remove_selected(), s);
    else if (s.selection.shown)
        show_edit(s.edit.remove(s.scene->model, s.selection.region, true), s);
}

SplatSet all_of(const Edit& edit, std::uint8_t value) {
    return SplatSet(edit.removed().size(), value);
}

void stop_and_close(Session& s) {
    if (cancel_stroke(s)) return;
    s.path.playing = false;
    s.error.clear();
    s.help = false;
    s.close_menus = true;
    // the dialog may lie over the form
    if (!std::exchange(s.open_dialog.shown, false)) s.train_form.shown = false;
    choose_tool(Tool::navigate, s);
    s.ask(request::CancelLoad{});
    s.ask(request::CancelWork{});
    s.ask(request::Stay{});
    s.ask(request::LeaveFullScreen{});
}

void look_from(Side side, Session& s) {
    leave_photo(s);
    s.navigation.view_from(side_of(s.navigation.up, side));
}

template <Tool tool>
void take_tool(Session& s) {
    choose_tool(tool, s);
}
template <Tool tool>
bool is_chosen(const Session& s) {
    return s.tools.tool == tool;
}

template <int mode>
void show_as(Session& s) {
    s.display.mode = mode;
}
template <int mode>
bool shows(const Session& s) {
    return s.display.mode == mode;
}

constexpr Command kCommands[] = {
    {Key::open,
     Menu::file,
     "Open ...",
     {"Ctrl+O"},
     "Choose a scene in a folder, or one that was opened before; a file can also be dropped on "
     "the window",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::ShowOpen{}); },
     always,
     nullptr},
    {Key::merge,
     Menu::file,
     "Add a scene ...",
     {"Ctrl+Shift+O"},
     "Add the splats of another file as a layer, at the positions that they have there",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::ShowOpen{OpenFor::adding}); },
     has_scene,
     nullptr},
    {Key::train,
     Menu::file,
     "Train from photos ...",
     {"Ctrl+T"},
     "Make a scene of a folder of photos, a video or a data set, and watch it grow",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::ShowTrain{}); },
     [](const Session& s) { return s.train_form.offered() && !run_goes_on(s); },
     nullptr},
    {Key::save,
     Menu::file,
     "Save",
     {"Ctrl+S"},
     "Save the edited scene",
     Icon::none,
     true,
     [](Session& s) { s.ask(request::Save{}); },
     has_scene,
     nullptr},
    {Key::save_page,
     Menu::file,
     "Save as web page",
     {},
     "Write an .html file for any browser beside the scene's file",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::SavePage{}); },
     has_scene,
     nullptr},
    {Key::picture,
     Menu::file,
     "Save a picture",
     {"P"},
     "Write darb_001.png, or the next free name, to the current folder",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::TakePicture{}); },
     always,
     nullptr},
    {Key::quit,
     Menu::file,
     "Quit",
     {"Ctrl+Q"},
     "Close the window; it asks where edits are not "
     "saved",
     Icon::none,
     true,
     [](Session& s) { s.ask(request::Quit{}); },
     always,
     nullptr},

    {Key::undo,
     Menu::edit,
     "Undo",
     {"Ctrl+Z"},
     "Take the last step back",
     Icon::undo,
     false,
     undo_edit,
     [](const Session& s) { return can_edit(s) && s.edit.can_undo(); },
     nullptr},
    {Key::redo,
     Menu::edit,
     "Redo",
     {"Ctrl+Y", "Ctrl+Shift+Z"},
     "Do the undone step again",
     Icon::redo,
     false,
     redo_edit,
     [](const Session& s) { return can_edit(s) && s.edit.can_redo(); },
     nullptr},
    {Key::remove,
     Menu::edit,
     "Delete",
     {"Delete", "Backspace"},
     "Delete the selected splats, or the last point while measuring",
     Icon::none,
     true,
     remove_selected,
     can_remove,
     nullptr},
    {Key::hide,
     Menu::edit,
     "Hide the selection",
     {"Ctrl+H"},
     "Hide the selected splats; they are still saved",
     Icon::none,
     false,
     [](Session& s) { show_edit(s.edit.hide_selected(), s); },
     has_selection,
     nullptr},
    {Key::show_hidden,
     Menu::edit,
     "Show what is hidden",
     {"Ctrl+U"},
     "Show all hidden splats",
     Icon::none,
     false,
     [](Session& s) { show_edit(s.edit.show_hidden(), s); },
     [](const Session& s) { return can_edit(s) && s.edit.hidden_count() > 0; },
     nullptr},

    {Key::select_all,
     Menu::select,
     "All",
     {"Ctrl+A"},
     "Select all splats",
     Icon::none,
     false,
     [](Session& s) { show_edit(s.edit.select(all_of(s.edit, 1), Combine::replace), s); },
     can_edit,
     nullptr},
    {Key::select_none,
     Menu::select,
     "None",
     {"Ctrl+D", "Ctrl+Shift+A"},
     "Select nothing",
     Icon::none,
     false,
     [](Session& s) { show_edit(s.edit.select(all_of(s.edit, 0), Combine::replace), s); },
     can_edit,
     nullptr},
    {Key::select_others,
     Menu::select,
     "The others",
     {"Ctrl+I"},
     "Select what is not selected, and nothing else",
     Icon::none,
     false,
     [](Session& s) { show_edit(s.edit.invert_selection(), s); },
     can_edit,
     nullptr},

    {Key::frame_all,
     Menu::view,
     "Frame all",
     {"F", "Home"},
     "Show the whole scene",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::FrameAll{}); },
     always,
     nullptr},
    {Key::level,
     Menu::view,
     "Level",
     {"L"},
     "Make the horizon level",
     Icon::none,
     false,
     [](Session& s) { s.navigation.level(); },
     always,
     nullptr},
    {Key::view_front,
     Menu::view,
     "From the front",
     {"Num 1"},
     "Look along an axis of the file, from the side",
     Icon::none,
     false,
     [](Session& s) { look_from(Side::front, s); },
     always,
     nullptr},
    {Key::view_right,
     Menu::view,
     "From the right",
     {"Num 3"},
     "Look along the other axis from the side",
     Icon::none,
     false,
     [](Session& s) { look_from(Side::right, s); },
     always,
     nullptr},
    {Key::view_top,
     Menu::view,
     "From above",
     {"Num 7"},
     "Look straight down",
     Icon::none,
     false,
     [](Session& s) { look_from(Side::top, s); },
     always,
     nullptr},
    {Key::next_camera,
     Menu::view,
     "Next photo",
     {"]"},
     "Look through the next camera of the "
     "photos",
     Icon::none,
     true,
     [](Session& s) { step_camera(s, true); },
     has_cameras,
     nullptr},
    {Key::last_camera,
     Menu::view,
     "Previous photo",
     {"["},
     "Look through the previous camera of the photos",
     Icon::none,
     false,
     [](Session& s) { step_camera(s, false); },
     has_cameras,
     nullptr},
    {Key::compare,
     Menu::view,
     "Photo beside the picture",
     {"V"},
     "Show the photo left of a line that can be dragged; needs a view through a photo's camera",
     Icon::compare,
     false,
     [](Session& s) {
         s.photos.compare = !s.photos.compare;
         s.photos.failed = false;
     },
     has_photo,
     [](const Session& s) { return s.photos.compare; }},
    {Key::show_cameras,
     Menu::view,
     "Cameras",
     {"C"},
     "Draw the cameras of the photos; a click on one looks through it",
     Icon::cameras,
     true,
     [](Session& s) { s.guides.cameras = !s.guides.cameras; },
     has_cameras,
     [](const Session& s) { return s.guides.cameras; }},
    {Key::show_grid,
     Menu::view,
     "Grid",
     {"G"},
     "Draw a grid on the ground over the picture",
     Icon::grid,
     false,
     [](Session& s) { s.guides.grid = !s.guides.grid; },
     always,
     [](const Session& s) { return s.guides.grid; }},
    {Key::show_axes,
     Menu::view,
     "Axes",
     {},
     "Draw the axes in the corner; a click on one looks "
     "along it",
     Icon::none,
     false,
     [](Session& s) { s.guides.axes = !s.guides.axes; },
     always,
     [](const Session& s) { return s.guides.axes; }},
    {Key::show_picture,
     Menu::view,
     "Picture",
     {},
     "Show the colours",
     Icon::none,
     true,
     show_as<VIEW_COLOUR>,
     always,
     shows<VIEW_COLOUR>},
    {Key::show_depth,
     Menu::view,
     "Depth",
     {},
     "Show how far away things are; near is light",
     Icon::none,
     false,
     show_as<VIEW_DEPTH>,
     always,
     shows<VIEW_DEPTH>},
    {Key::show_work,
     Menu::view,
     "Splats per pixel",
     {},
     "Show how many splats each pixel needs",
     Icon::none,
     false,
     show_as<VIEW_COUNT>,
     always,
     shows<VIEW_COUNT>},
    {Key::show_error,
     Menu::view,
     "Difference from the photo",
     {},
     "Show where the picture differs from the photo; needs a view through a photo's camera",
     Icon::none,
     false,
     show_as<VIEW_ERROR>,
     has_photo,
     shows<VIEW_ERROR>},
    {Key::hide_panels,
     Menu::view,
     "Panels",
     {"H"},
     "Hide or show everything but the picture",
     Icon::none,
     true,
     [](Session& s) { s.panels = !s.panels; },
     always,
     [](const Session& s) { return s.panels; }},
    {Key::full_screen,
     Menu::view,
     "Full screen",
     {"F11"},
     "Fill the screen, or leave that",
     Icon::none,
     false,
     [](Session& s) { s.ask(request::ToggleFullScreen{}); },
     always,
     nullptr},

    {Key::tool_navigate,
     Menu::tools,
     "Orbit",
     {"1"},
     "Drag with the left button to turn the scene",
     Icon::orbit,
     false,
     take_tool<Tool::navigate>,
     always,
     is_chosen<Tool::navigate>},
    {Key::tool_rectangle,
     Menu::tools,
     "Select by rectangle",
     {"2", "R"},
     "Select in a rectangle, hidden splats behind others too; Shift adds, Ctrl takes away",
     Icon::rectangle,
     true,
     take_tool<Tool::rectangle>,
     has_scene,
     is_chosen<Tool::rectangle>},
    {Key::tool_lasso,
     Menu::tools,
     "Select by lasso",
     {"3"},
     "Select inside an outline; Shift adds, Ctrl takes away",
     Icon::lasso,
     false,
     take_tool<Tool::lasso>,
     has_scene,
     is_chosen<Tool::lasso>},
    {Key::tool_polygon,
     Menu::tools,
     "Select by polygon",
     {"Shift+3"},
     "Click corners; a click on the first one, or a double click, selects what is inside; Delete "
     "takes the last corner away; Shift adds, Ctrl takes away",
     Icon::polygon,
     false,
     take_tool<Tool::polygon>,
     has_scene,
     is_chosen<Tool::polygon>},
    {Key::tool_brush,
     Menu::tools,
     "Select by brush",
     {"4", "B"},
     "Select by painting; Shift adds, Ctrl takes away",
     Icon::brush,
     false,
     take_tool<Tool::brush>,
     has_scene,
     is_chosen<Tool::brush>},
    {Key::tool_sphere,
     Menu::tools,
     "Select by sphere",
     {"5"},
     "Select around the splat where the drag begins; Shift adds, Ctrl takes away",
     Icon::sphere,
     false,
     take_tool<Tool::sphere>,
     has_scene,
     is_chosen<Tool::sphere>},
    {Key::tool_flood,
     Menu::tools,
     "Select by flood",
     {"O"},
     "Click a surface to select its splat and what touches it in like colours; Shift adds, Ctrl "
     "takes away",
     Icon::flood,
     false,
     take_tool<Tool::flood>,
     has_scene,
     is_chosen<Tool::flood>},
    {Key::tool_move,
     Menu::tools,
     "Move",
     {"6"},
     "Drag an arrow to move the selection, or everything if nothing is selected",
     Icon::move,
     true,
     take_tool<Tool::move>,
     has_scene,
     is_chosen<Tool::move>},
    {Key::tool_turn,
     Menu::tools,
     "Turn",
     {"7"},
     "Drag a ring to turn the selection, together with its view-dependent colours",
     Icon::turn,
     false,
     take_tool<Tool::turn>,
     has_scene,
     is_chosen<Tool::turn>},
    {Key::tool_scale,
     Menu::tools,
     "Scale",
     {"8"},
     "Drag the ring to scale the selection",
     Icon::scale,
     false,
     take_tool<Tool::scale>,
     has_scene,
     is_chosen<Tool::scale>},
    {Key::tool_measure,
     Menu::tools,
     "Measure",
     {"9", "M"},
     "Click points of the surface to measure between them",
     Icon::measure,
     true,
     take_tool<Tool::measure>,
     has_scene,
     is_chosen<Tool::measure>},
    {Key::add_key,
     Menu::tools,
     "Add a key frame",
     {"K"},
     "Add the camera's position to the camera path",
     Icon::none,
     true,
     [](Session& s) { s.path.path.add(s.navigation, s.path.seconds_per_key); },
     always,
     nullptr},
    {Key::play,
     Menu::tools,
     "Play or pause",
     {"Space"},
     "Play the camera path; during training, pause or go on",
     Icon::play,
     false,
     play_or_pause,
     [](const Session& s) { return run_goes_on(s) || !s.path.path.keys.empty(); },
     [](const Session& s) { return s.path.playing || (run_goes_on(s) && !s.training.paused); }},
    {Key::step,
     Menu::tools,
     "One step of training",
     {"."},
     "Train one iteration, then pause",
     Icon::none,
     false,
     step_training,
     run_goes_on,
     nullptr},

    {Key::help,
     Menu::help,
     "Keys and mouse",
     {"?", "F1"},
     "List all keys",
     Icon::none,
     false,
     [](Session& s) { s.help = !s.help; },
     always,
     [](const Session& s) { return s.help; }},
    {Key::escape,
     Menu::none,
     "Stop, cancel, close, leave full screen",
     {"Esc"},
     "Take a drag back, cancel work, close messages, go back to orbiting",
     Icon::none,
     false,
     stop_and_close,
     always,
     nullptr},
};

constexpr HeldRow kHeld[] = {
    {"left drag", "orbit"},
    {"right drag", "look around"},
    {"middle or Shift+left drag", "pan"},
    {"wheel", "zoom, or change the speed while flying"},
    {"double click", "orbit around this point"},
    {"W A S D Q E", "fly"},
    {"click an axis", "look along it"},
    {"click a camera", "look through it"},
    {"drag a line", "move the border between photo and kernels"},
    {"Shift, Ctrl while selecting", "add, take away"},
    {"drop a file", "open a scene, or show a mesh with it"},
};

constexpr std::string_view kShift = "Shift+";

const Command* with_chord(std::string_view chord) {
    for (const Command& c : kCommands)
        for (const char* key : c.keys)
            if (key != nullptr && key == chord) return &c;
    return nullptr;
}

}  // namespace

std::span<const Command> commands() {
    return kCommands;
}

const Command& command(Key id) {
    const auto* const found = std::ranges::find(kCommands, id, &Command::id);
    DARB_CHECK(found != std::end(kCommands), "command {}", static_cast<int>(id));
    return *found;
}

std::optional<Key> command_of(std::string_view chord) {
    if (const Command* c = with_chord(chord)) return c->id;
    const std::size_t shift = chord.find(kShift);
    if (shift == std::string_view::npos) return {};
    const std::string plain =
        std::string(chord.substr(0, shift)) + std::string(chord.substr(shift + kShift.size()));
    const Command* c = with_chord(plain);
    return c != nullptr ? std::optional(c->id) : std::nullopt;
}

std::string keys_text(const Command& command) {
    std::string text;
    for (const char* key : command.keys)
        if (key != nullptr) text += (text.empty() ? "" : " or ") + std::string(key);
    return text;
}

std::string command_tip(const Command& command) {
    const std::string keys = keys_text(command);
    return command.name + (keys.empty() ? "" : " (" + keys + ")") + "\n" + command.tip;
}

std::span<const HeldRow> held_inputs() {
    return kHeld;
}

}  // namespace darb
