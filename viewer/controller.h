// SPDX-License-Identifier: MIT
// Controller: what was asked. Keys, the pointer and its tools act on the document at once. Their
// requests, and those from the panels and the window, are carried out in order by the document and
// the painter.
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

    /// Takes the result of a load that ended since the last frame.
    void take_loaded();
    /// Waits for all loads, also of scenes to add. Throws their Error.
    void finish_loading();
    /// Takes the pictures that a running training has drawn since the last frame.
    void take_pictures_of_run();
    /// Shows what was loaded. Throws Error and keeps the current scene.
    void show(LoadedScene loaded);
    /// Takes what the user did since the last frame. Returns whether a key is held that keeps
    /// moving the camera.
    bool take_input(const Input& input, const ControlFrame& frame);
    /// Carries out the requests that wait.
    void act(int width, int height);
    /// Seconds until a message over the picture goes away; infinity where there is none.
    double expire_toasts();

  private:
    void take(LoadedScene loaded);
    void drop(const std::filesystem::path& path, bool adds = false);
    void show_open(OpenFor purpose);
    void show_train(const std::filesystem::path& dataset);
    void open_file(const std::filesystem::path& file, bool merges);
    void merge(LoadedScene loaded);
    void show_edits();
    void open_mesh(const std::filesystem::path& file);
    void make_mesh();
    void pick(const request::PickPoint& at, int width, int height);
    void flood(const request::Flood& from, int width, int height);
    void take_picture(int width, int height);
    void quit();
    void leave();
    void save_and_leave();

    Device* device_;
    Session* session_;
    Document* document_;
    Painter* painter_;
    int told_ = 0;  // Session::told at the last frame
};

}  // namespace darb
