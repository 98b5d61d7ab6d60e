// SPDX-License-Identifier: MIT
// The commands of the window, in one table: menus, toolbar, tooltips, the list of keys and what a
// key does all come from it.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "viewer/input.h"
#include "viewer/session.h"

namespace darb {

/// What a button of the toolbar shows; drawn by panels/icons.h.
enum class Icon {
    none,
    orbit,
    rectangle,
    lasso,
    brush,
    sphere,
    move,
    turn,
    scale,
    measure,
    polygon,
    flood,
    compare,
    cameras,
    grid,
    play,
    undo,
    redo
};

/// The menus, in their order. `none`: in no menu, but in the list of keys.
enum class Menu { file, edit, select, view, tools, help, none };
inline constexpr std::array<const char*, 6> kMenuNames{"File", "Edit",  "Select",
                                                       "View", "Tools", "Help"};

struct Command {
    Key id;
    Menu menu;
    const char* name;  // as menus have it
    /// Chords such as "Ctrl+Shift+Z", the first of which menus show; empty ones are none.
    std::array<const char*, 2> keys;
    const char* tip;  // a sentence without a full stop
    Icon icon;
    bool divided;  // a line before it in its menu
    void (*act)(Session&);
    bool (*enabled)(const Session&);
    bool (*checked)(const Session&);  // null: nothing that is on or off
};

/// The whole table, in the order of the menus.
std::span<const Command> commands();
const Command& command(Key id);
/// The command that has this chord; without "Shift+" where none has it with. Nothing where there
/// is none.
std::optional<Key> command_of(std::string_view chord);
/// "Undo (Ctrl+Z)", and the tip in a line below.
std::string command_tip(const Command& command);
/// Both keys, as "Ctrl+Y or Ctrl+Shift+Z"; empty where there is none.
std::string keys_text(const Command& command);

/// What the mouse does and keys that are held, for the list of keys.
struct HeldRow {
    const char *input, *does;
};
std::span<const HeldRow> held_inputs();
/// The keys that fly while they are held, which no command may have alone.
inline constexpr std::string_view kFlyKeys = "WASDQE";

}  // namespace darb
