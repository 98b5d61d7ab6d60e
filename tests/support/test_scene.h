// SPDX-License-Identifier: MIT
// Random scenes, by their short names in tests.
#pragma once

#include "engine/reference/splats.h"

namespace darb::test {

using reference::random_scene;
using reference::rotation_of;
using reference::SceneOptions;
using reference::TestScene;

}  // namespace darb::test
