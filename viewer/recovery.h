// Recovery: what a session has not saved, in files of its own, where its window ends without a
// question: the display is gone, a signal comes, a device fails.
#pragma once

#include <string>

#include "viewer/session.h"

namespace darb {

/// Writes the edited scene and the camera path that were not saved, beside the scene or, where that
/// cannot be written, into the current or the temporary folder: NAME_recovered.ply and
/// camera_path_recovered.json, with a number where those are there. Returns a sentence for each,
/// with the file or with why there is none; empty where nothing was unsaved. Never throws Error.
std::string recover_unsaved(const Session& session);

}  // namespace darb
