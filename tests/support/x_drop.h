// SPDX-License-Identifier: MIT
// What only a client of the X server can do for a test: drop a file on a window, as a file manager
// does (the source's side of the XDND protocol, version 5), and set the display's dots per inch.
#pragma once

#include <X11/Xatom.h>
#include <X11/Xlib.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

namespace darb::test {

struct CloseXDisplay {
    void operator()(Display* display) const { XCloseDisplay(display); }
};
using XDisplay = std::unique_ptr<Display, CloseXDisplay>;

/// Sets the resource Xft.dpi, as a desktop does before programs start.
inline void set_display_dpi(int dpi) {
    const XDisplay display(XOpenDisplay(nullptr));
    if (!display) return;
    const std::string text = "Xft.dpi:\t" + std::to_string(dpi) + "\n";
    XChangeProperty(display.get(), DefaultRootWindow(display.get()), XA_RESOURCE_MANAGER, XA_STRING,
                    8, PropModeReplace, reinterpret_cast<const unsigned char*>(text.data()),
                    static_cast<int>(text.size()));
    XSync(display.get(), False);
    // Closing must not take the property away.
    XSetCloseDownMode(display.get(), RetainPermanent);
}

inline Window window_by_name(Display* display, Window below, const std::string& part) {
    Window root = 0, parent = 0, *children = nullptr;
    unsigned count = 0;
    Window found = 0;
    if (XQueryTree(display, below, &root, &parent, &children, &count) == 0) return 0;
    for (unsigned i = 0; i < count && found == 0; ++i) {
        char* name = nullptr;
        if (XFetchName(display, children[i], &name) != 0 && name != nullptr) {
            if (std::string(name).find(part) != std::string::npos) found = children[i];
            XFree(name);
        }
        if (found == 0) found = window_by_name(display, children[i], part);
    }
    if (children != nullptr) XFree(children);
    return found;
}

/// The path as a URI: everything but letters, digits and -._~/ as %XX.
inline std::string file_uri(const std::filesystem::path& file) {
    std::string uri = "file://";
    for (const char c : file.string()) {
        const auto u = static_cast<unsigned char>(c);
        if (std::isalnum(u) != 0 || std::string("-._~/").find(c) != std::string::npos) {
            uri += c;
            continue;
        }
        constexpr const char* kHex = "0123456789ABCDEF";
        uri += '%';
        uri += kHex[u >> 4];
        uri += kHex[u & 15];
    }
    return uri;
}

/// Drops the file on the first window whose name contains `name`. Returns false where there is
/// none, or where it has not taken the file within a minute.
inline bool drop_on_window(const std::string& name, const std::filesystem::path& file) {
    const XDisplay opened(XOpenDisplay(nullptr));
    Display* d = opened.get();
    if (d == nullptr) return false;
    const Window root = DefaultRootWindow(d), target = window_by_name(d, root, name);
    if (target == 0) return false;
    const Window source = XCreateSimpleWindow(d, root, 0, 0, 1, 1, 0, 0, 0);
    const auto atom = [&](const char* text) { return XInternAtom(d, text, False); };
    const Atom selection = atom("XdndSelection"), list = atom("text/uri-list");
    const auto say = [&](const char* type, long a, long b, long c, long e) {
        XEvent event{};
        event.xclient.type = ClientMessage;
        event.xclient.window = target;
        event.xclient.message_type = atom(type);
        event.xclient.format = 32;
        event.xclient.data.l[0] = static_cast<long>(source);
        event.xclient.data.l[1] = a;
        event.xclient.data.l[2] = b;
        event.xclient.data.l[3] = c;
        event.xclient.data.l[4] = e;
        XSendEvent(d, target, False, NoEventMask, &event);
    };
    XSetSelectionOwner(d, selection, source, CurrentTime);
    say("XdndEnter", 5L << 24, static_cast<long>(list), 0, 0);
    say("XdndPosition", 0, 100L << 16 | 100, CurrentTime,
        static_cast<long>(atom("XdndActionCopy")));
    say("XdndDrop", 0, CurrentTime, 0, 0);
    XFlush(d);
    const std::string uris = file_uri(file) + "\r\n";
    const Atom finished = atom("XdndFinished");
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (std::chrono::steady_clock::now() < end) {
        if (XPending(d) == 0) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            continue;
        }
        XEvent event{};
        XNextEvent(d, &event);
        if (event.type == ClientMessage && event.xclient.message_type == finished) return true;
        if (event.type != SelectionRequest) continue;
        const XSelectionRequestEvent& asked = event.xselectionrequest;
        XChangeProperty(d, asked.requestor, asked.property, asked.target, 8, PropModeReplace,
                        reinterpret_cast<const unsigned char*>(uris.data()),
                        static_cast<int>(uris.size()));
        XEvent answer{};
        answer.xselection.type = SelectionNotify;
        answer.xselection.requestor = asked.requestor;
        answer.xselection.selection = asked.selection;
        answer.xselection.target = asked.target;
        answer.xselection.property = asked.property;
        answer.xselection.time = asked.time;
        XSendEvent(d, asked.requestor, False, NoEventMask, &answer);
        XFlush(d);
    }
    return false;
}

}  // namespace darb::test
