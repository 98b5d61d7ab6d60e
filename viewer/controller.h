// SPDX-License-Identifier: MIT
// Controller: what was asked. Keys, the pointer and its tools act on the document at once; what
// they, the panels and the window request is done by the document and the painter, in order.
#pragma once

#include <filesystem>
#include <optional>

#include "viewer/controls.h"
#include "viewer/document.h"
#include "viewer/painter.h"

namespace darb {

class Controller {
  public:
    Controller(Device& device, Session& session, Document& document, Painter& painter)
        : device_(&device), session_(&session), document_(&document), painter_(&painter) {}

    /// What a load ended with since the last frame.
    void take_loaded();
    /// What the run that is shown has drawn since the last frame.
    void take_pictures_of_run();
    /// Shows what was loaded. Throws Error and keeps the scene before.
    void show(LoadedScene loaded);
    /// What the user did since the last frame. Whether a key is held that goes on moving the camera
    /// by itself.
    bool take_input(const Input& input, const ControlFrame& frame);
    /// The requests that wait.
    void act(int width, int height);
    /// Seconds until a message over the picture goes; infinity where there is none.
    double expire_toasts();

  private:
    void drop(const std::filesystem::path& path);
    void show_open(bool merges);
    void open_file(const std::filesystem::path& file, bool merges);
    void merge(LoadedScene loaded);
    void show_edits();
    void take_picture(int width, int height);
    void quit();
    void leave();
    void save_and_leave();

    Device* device_;
    Session* session_;
    Document* document_;
    Painter* painter_;
    int told_ = 0;  // Session::told of the last frame
};

}  // namespace darb
