// SPDX-License-Identifier: MIT
#define GLFW_INCLUDE_VULKAN
#include "viewer/window.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "viewer/commands.h"
#include "viewer/swapchain.h"

namespace darb {

namespace {

constexpr double kDoubleClick_s = 0.35;
constexpr int kSettlingFrames = 2;  // the panels need one frame to react to a change in another

std::string last_error() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text != nullptr ? text : "unknown";
}

// GLFW names printable keys by their characters on a US keyboard.
std::string key_name(int key) {
    if (key == GLFW_KEY_SPACE) return "Space";
    if (key > GLFW_KEY_SPACE && key <= GLFW_KEY_GRAVE_ACCENT)
        return std::string(1, static_cast<char>(key));
    if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12) return fmt::format("F{}", key - GLFW_KEY_F1 + 1);
    if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9)
        return fmt::format("Num {}", key - GLFW_KEY_KP_0);
    switch (key) {
        case GLFW_KEY_DELETE:
            return "Delete";
        case GLFW_KEY_BACKSPACE:
            return "Backspace";
        case GLFW_KEY_HOME:
            return "Home";
        case GLFW_KEY_ESCAPE:
            return "Esc";
        default:
            return "";
    }
}

std::optional<Key> key_for(int key, int mods) {
    const std::string name = key_name(key);
    if (name.empty()) return {};
    return command_of(((mods & GLFW_MOD_CONTROL) != 0 ? "Ctrl+" : "") +
                      std::string((mods & GLFW_MOD_SHIFT) != 0 ? "Shift+" : "") + name);
}

struct GlfwWindow {
    GlfwWindow(int width, int height) {
        glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
        handle = glfwCreateWindow(width, height, "darb", nullptr, nullptr);
        if (handle == nullptr) throw Error("window", last_error());
    }
    ~GlfwWindow() { glfwDestroyWindow(handle); }
    GlfwWindow(const GlfwWindow&) = delete;
    GlfwWindow& operator=(const GlfwWindow&) = delete;
    GLFWwindow* handle;
};

VkSurfaceKHR make_surface(Device& device, GLFWwindow* window) {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    check_vulkan(glfwCreateWindowSurface(device.instance(), window, nullptr, &surface), "window");
    return surface;
}

// The scale of the panels, in px. wanted: 0 means the desktop's choice.
float panel_scale(GLFWwindow* window, float wanted) {
    float x = 1, y = 1;
    glfwGetWindowContentScale(window, &x, &y);
    return wanted > 0 ? wanted : std::clamp(std::max(x, y), 1.0f, 4.0f);
}

}  // namespace

WindowSystem::WindowSystem() {
    if (glfwInit() != GLFW_TRUE)
        throw Error("window system", last_error(),
                    "Start it inside a desktop session, or use darb view --screenshot or darb "
                    "render.");
    if (glfwVulkanSupported() == GLFW_TRUE) return;
    glfwTerminate();
    throw Error("window system", "no Vulkan driver can show windows here",
                "Use darb view --screenshot or darb render.");
}

WindowSystem::~WindowSystem() {
    glfwTerminate();
}

void WindowSystem::require(DeviceOptions& options) const {
    std::uint32_t count = 0;
    const char** names = glfwGetRequiredInstanceExtensions(&count);
    options.instance_extensions.assign(names, names + count);
    options.device_extensions = {VK_KHR_SWAPCHAIN_EXTENSION_NAME};
}

// The callbacks collect input here. ImGui's callbacks are installed later and call these first.
struct ViewerWindow::State {
    State(Device& device, const ViewerOptions& options, int width, int height)
        : window(width, height),
          swapchain(device, make_surface(device, window.handle)),
          wanted_scale(options.gui_scale) {
        glfwSetWindowUserPointer(window.handle, this);
        install_callbacks();
        ViewerOptions mine = options;
        mine.gui_scale = panel_scale(window.handle, wanted_scale);
        mine.wake = [this] {
            woken = true;
            glfwPostEmptyEvent();
        };
        viewer.emplace(device, mine, window.handle);
        glfwGetWindowPos(window.handle, &windowed[0], &windowed[1]);
        glfwGetWindowSize(window.handle, &windowed[2], &windowed[3]);
    }
    void install_callbacks();
    void collect();
    void drag(double x, double y);
    glm::dvec2 pointer() const;  // px; where it is now, later than the events that wait
    void note_buttons();
    bool* held_key(int key);  // the key's flag in input, or null
    void draw();
    void close_minimised();
    void obey(WindowRequest request);
    void toggle_full_screen();
    static State& of(GLFWwindow* w) { return *static_cast<State*>(glfwGetWindowUserPointer(w)); }

    GlfwWindow window;
    Swapchain swapchain;
    std::optional<Viewer> viewer;
    float wanted_scale;  // scale of the panels; 0: the desktop's
    std::string title;
    Input input;
    bool dirty = true;
    int settling = 0;
    std::atomic<bool> woken{false};
    double next_frame_at = 0;  // s of GLFW's clock
    double last_click = -1;
    std::optional<glm::dvec2> last_pointer;  // px
    int windowed[4] = {0, 0, 1280, 720};     // place and size outside full screen
};

void ViewerWindow::State::install_callbacks() {
    GLFWwindow* w = window.handle;
    glfwSetKeyCallback(w, [](GLFWwindow* from, int key, int, int action, int mods) {
        State& s = of(from);
        s.dirty = true;
        if (action != GLFW_PRESS) return;
        if (bool* held = s.held_key(key)) *held = true;  // also when it is let go before the frame
        if (const auto k = key_for(key, mods)) s.input.pressed.push_back(*k);
    });
    glfwSetMouseButtonCallback(w, [](GLFWwindow* from, int button, int action, int) {
        State& s = of(from);
        s.dirty = true;
        if (button != GLFW_MOUSE_BUTTON_LEFT || action != GLFW_PRESS) return;
        s.input.left = true;
        s.input.trail.push_back(s.last_pointer.value_or(s.pointer()));
        const double now = glfwGetTime();
        s.input.double_click = now - s.last_click < kDoubleClick_s;
        s.last_click = s.input.double_click ? -1 : now;
    });
    glfwSetCursorPosCallback(w, [](GLFWwindow* from, double x, double y) { of(from).drag(x, y); });
    glfwSetScrollCallback(w, [](GLFWwindow* from, double, double y) {
        of(from).input.wheel += y;
        of(from).dirty = true;
    });
    glfwSetDropCallback(w, [](GLFWwindow* from, int count, const char** paths) {
        for (int i = 0; i < count; ++i) of(from).input.dropped.emplace_back(paths[i]);
        of(from).dirty = true;
    });
    glfwSetCharCallback(w, [](GLFWwindow* from, unsigned character) {  // by whatever key has it
        if (const auto k = character == '?' ? command_of("?") : std::nullopt)
            of(from).input.pressed.push_back(*k);
        of(from).dirty = true;
    });
    glfwSetWindowRefreshCallback(w, [](GLFWwindow* from) { of(from).dirty = true; });
    glfwSetFramebufferSizeCallback(w, [](GLFWwindow* from, int, int) { of(from).dirty = true; });
    glfwSetWindowContentScaleCallback(w, [](GLFWwindow* from, float, float) {
        State& s = of(from);
        if (s.viewer) s.viewer->set_gui_scale(panel_scale(from, s.wanted_scale));
        s.dirty = true;
    });
    glfwSetWindowCloseCallback(w, [](GLFWwindow* from) {  // the viewer may have a question first
        State& s = of(from);
        if (s.viewer) s.viewer->session().ask(request::Quit{});
        s.dirty = true;
        glfwSetWindowShouldClose(from, GLFW_FALSE);
    });
}

bool* ViewerWindow::State::held_key(int key) {
    switch (key) {
        case GLFW_KEY_W:
            return &input.ahead;
        case GLFW_KEY_S:
            return &input.back;
        case GLFW_KEY_A:
            return &input.to_left;
        case GLFW_KEY_D:
            return &input.to_right;
        case GLFW_KEY_E:
            return &input.rise;
        case GLFW_KEY_Q:
            return &input.sink;
        default:
            return nullptr;
    }
}

void ViewerWindow::State::note_buttons() {
    const auto button = [&](int b) { return glfwGetMouseButton(window.handle, b) == GLFW_PRESS; };
    input.left |= button(GLFW_MOUSE_BUTTON_LEFT);
    input.middle |= button(GLFW_MOUSE_BUTTON_MIDDLE);
    input.right |= button(GLFW_MOUSE_BUTTON_RIGHT);
}

// Motion with a button down adds up event by event, because a quick drag may begin and end between
// frames.
void ViewerWindow::State::drag(double x, double y) {
    dirty = true;
    const glm::dvec2 at = glm::dvec2(x, y) * double{pixels_per_unit(window.handle)};
    const glm::dvec2 by = at - std::exchange(last_pointer, at).value_or(at);
    const auto down = [&](int b) { return glfwGetMouseButton(window.handle, b) == GLFW_PRESS; };
    if (down(GLFW_MOUSE_BUTTON_LEFT)) input.trail.push_back(at);
    if (down(GLFW_MOUSE_BUTTON_LEFT) || down(GLFW_MOUSE_BUTTON_MIDDLE) ||
        down(GLFW_MOUSE_BUTTON_RIGHT)) {
        note_buttons();
        input.dx += by.x;
        input.dy += by.y;
    }
}

glm::dvec2 ViewerWindow::State::pointer() const {
    glm::dvec2 at(0.0);
    glfwGetCursorPos(window.handle, &at.x, &at.y);
    return at * double{pixels_per_unit(window.handle)};
}

// Collects what is a state rather than an event: pointer, buttons, held keys.
void ViewerWindow::State::collect() {
    GLFWwindow* w = window.handle;
    input.x = pointer().x;
    input.y = pointer().y;
    const auto key = [&](int k) { return glfwGetKey(w, k) == GLFW_PRESS; };
    input.shift = key(GLFW_KEY_LEFT_SHIFT) || key(GLFW_KEY_RIGHT_SHIFT);
    input.control = key(GLFW_KEY_LEFT_CONTROL) || key(GLFW_KEY_RIGHT_CONTROL);
    for (const int k : {GLFW_KEY_W, GLFW_KEY_S, GLFW_KEY_A, GLFW_KEY_D, GLFW_KEY_E, GLFW_KEY_Q})
        *held_key(k) |= key(k);
    note_buttons();
}

void ViewerWindow::State::toggle_full_screen() {
    GLFWwindow* w = window.handle;
    if (glfwGetWindowMonitor(w) != nullptr) {
        glfwSetWindowMonitor(w, nullptr, windowed[0], windowed[1], windowed[2], windowed[3], 0);
        return;
    }
    glfwGetWindowPos(w, &windowed[0], &windowed[1]);
    glfwGetWindowSize(w, &windowed[2], &windowed[3]);
    GLFWmonitor* monitor = glfwGetPrimaryMonitor();
    const GLFWvidmode* mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
    if (mode != nullptr)
        glfwSetWindowMonitor(w, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

// A minimised window has no frame in which to ask.
void ViewerWindow::State::close_minimised() {
    const Session& session = viewer->session();
    if (!asks_for<request::Quit>(session.requests)) return;
    if (asks_before_quitting(session))
        glfwRestoreWindow(window.handle);
    else
        glfwSetWindowShouldClose(window.handle, GLFW_TRUE);
}

void ViewerWindow::State::draw() {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window.handle, &width, &height);
    if (width == 0 || height == 0) {  // minimised
        next_frame_at = std::numeric_limits<double>::infinity();
        dirty = false;
        settling = 0;
        close_minimised();
        return;
    }
    collect();
    settling = dirty ? kSettlingFrames : settling - 1;
    dirty = false;
    const double wanted_in = viewer->frame(input, width, height, false);
    next_frame_at = glfwGetTime() + wanted_in;
    input = Input();
    if (!swapchain.present(viewer->canvas(), [&] { viewer->compose(); })) dirty = true;
    viewer->presented();
    if (title != viewer->session().title) {
        title = viewer->session().title;
        glfwSetWindowTitle(window.handle, title.c_str());
    }
    for (const WindowRequest request : viewer->session().for_window) obey(request);
}

void ViewerWindow::State::obey(WindowRequest request) {
    const bool is_full = glfwGetWindowMonitor(window.handle) != nullptr;
    if (request == WindowRequest::close)
        glfwSetWindowShouldClose(window.handle, GLFW_TRUE);
    else if (request == WindowRequest::toggle_full_screen || is_full)
        toggle_full_screen();
}

ViewerWindow::ViewerWindow(Device& device, ViewerOptions options, int width, int height)
    : state_(std::make_unique<State>(device, options, width, height)) {}

ViewerWindow::~ViewerWindow() = default;

Viewer& ViewerWindow::viewer() {
    return *state_->viewer;
}

void ViewerWindow::set_title(const std::string& title) {
    glfwSetWindowTitle(state_->window.handle, title.c_str());
}

void ViewerWindow::redraw() {
    state_->dirty = true;
}

void ViewerWindow::wake() {
    state_->woken = true;
    glfwPostEmptyEvent();
}

bool ViewerWindow::pump(double patience_s) {
    State& s = *state_;
    const auto due = [&] { return s.dirty || s.settling > 0 || glfwGetTime() >= s.next_frame_at; };
    const double sleep = due() ? 0 : std::min(patience_s, s.next_frame_at - glfwGetTime());
    if (sleep <= 0)
        glfwPollEvents();
    else if (std::isfinite(sleep))
        glfwWaitEventsTimeout(sleep);
    else
        glfwWaitEvents();
    // The frame counts as dirty, as after an event: the message that ends a load takes frames to
    // appear.
    if (s.woken.exchange(false)) s.dirty = true;
    if (due()) s.draw();
    return glfwWindowShouldClose(s.window.handle) == GLFW_FALSE;
}

}  // namespace darb
