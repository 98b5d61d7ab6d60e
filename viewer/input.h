// Input: what mouse and keys did since the last frame, free of any window system.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <vector>

namespace darb {

enum class Key {
    frame_all,    // F
    level,        // L
    hide_panels,  // H
    full_screen,  // F11
    picture,      // P
    next_camera,  // ]
    last_camera,  // [
    add_key,      // K
    play,         // space: a path, or a training run that is paused
    step,         // . : one step of a training run, which then pauses
    select_all,
    select_none,
    select_others,  // Ctrl A, D, I
    hide,
    show_hidden,  // Ctrl H, U
    open,         // Ctrl O
    // 1 to 8, in the order of Tool.
    tool_navigate,
    tool_rectangle,
    tool_lasso,
    tool_brush,
    tool_sphere,
    tool_move,
    tool_turn,
    tool_scale,
    remove,  // Delete
    undo,    // Ctrl Z
    redo,    // Ctrl Y
    save,    // Ctrl S
    quit,    // Ctrl Q
    help,    // ?
    escape,  // Esc: leaves full screen, stops playing, cancels loading
};

struct Input {
    double x = 0, y = 0;    // px, pointer
    double dx = 0, dy = 0;  // px that it moved with a button down, since the last frame
    double wheel = 0;       // steps, up positive
    // Down now or during that motion.
    bool left = false, middle = false, right = false, shift = false, control = false;
    bool double_click = false;
    std::vector<glm::dvec2> trail;  // px, where it was pressed and dragged with the left button
    // Held: W S A D E Q.
    bool ahead = false, back = false, to_left = false, to_right = false, rise = false, sink = false;
    std::vector<Key> pressed;
    std::vector<std::filesystem::path> dropped;
};

}  // namespace darb
