// Both functions are looked for in what is loaded: GLFW may be built without X11, and an older
// libX11 lacks the second.
#include "viewer/display_loss.h"

#include <dlfcn.h>

namespace darb {

bool survive_display_loss(std::atomic<bool>& lost) {
    using GetDisplay = void* (*)();
    using OnExit = void (*)(void* display, void* user);
    using SetOnExit = void (*)(void* display, OnExit on_exit, void* user);
    void* const x11 = ::dlopen("libX11.so.6", RTLD_LAZY | RTLD_NOLOAD);  // kept until the end
    const auto get_display =
        reinterpret_cast<GetDisplay>(::dlsym(RTLD_DEFAULT, "glfwGetX11Display"));
    if (x11 == nullptr || get_display == nullptr) return false;
    const auto set = reinterpret_cast<SetOnExit>(::dlsym(x11, "XSetIOErrorExitHandler"));
    using OnError = int (*)(void* display);
    using SetOnError = OnError (*)(OnError on_error);
    const auto set_on_error = reinterpret_cast<SetOnError>(::dlsym(x11, "XSetIOErrorHandler"));
    void* const display = set != nullptr && set_on_error != nullptr ? get_display() : nullptr;
    if (display == nullptr) return false;
    // The first handler ends the process unless it is replaced, the second one if the first
    // returns.
    set_on_error([](void*) { return 0; });
    set(
        display, [](void*, void* user) { *static_cast<std::atomic<bool>*>(user) = true; }, &lost);
    return true;
}

}  // namespace darb
