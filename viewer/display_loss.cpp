// Functions are looked for in what is loaded: GLFW may be built without X11, and an older libX11
// lacks one of them.
#include "viewer/display_loss.h"

#include <dlfcn.h>

#include <cstddef>
#include <cstdlib>

namespace darb {

namespace {

constexpr std::size_t kRequestRoom = 1
                                     << 20;  // bytes: requests of a window's end take some hundred

// How Xlib's Display begins (X11/Xlib.h: _XPrivDisplay, with the names of X11/Xlibint.h).
struct DisplayHead {
    void *extensions, *free_functions;
    int socket, connection_index, major_version, minor_version;
    char* vendor;
    unsigned long id_base, id_mask, next_id;
    int id_shift;
    void (*id_allocator)();
    int byte_order, bitmap_unit, bitmap_pad, bitmap_order, format_count;
    void* formats;
    int vendor_number, release;
    void *queue_head, *queue_tail;
    int queue_length;
    unsigned long last_read, last_sent;
    char *last_request, *buffer, *end, *limit;  // of the requests that wait to be sent
};

// Requests find no room once Xcb has the connection back and it is dead: Xlib then returns a null
// that its own functions do not look for. Nothing of what goes into this room is sent.
void make_room(void* display) {
    auto* const head = static_cast<DisplayHead*>(display);
    auto* const room = static_cast<char*>(std::malloc(kRequestRoom));  // XCloseDisplay frees it
    if (room == nullptr) return;
    std::free(head->buffer);
    head->buffer = head->end = head->last_request = room;
    head->limit = room + kRequestRoom;
}

void note_loss(void* display, void* user) {
    *static_cast<std::atomic<bool>*>(user) = true;
    make_room(display);
}

}  // namespace

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
    set(display, note_loss, &lost);
    return true;
}

}  // namespace darb
