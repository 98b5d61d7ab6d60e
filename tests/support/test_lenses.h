// SPDX-License-Identifier: MIT
// Lenses of every form for the cameras of random_scene.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/scene/camera.h"

namespace darb::test {

inline std::vector<std::pair<std::string, LensTerms>> test_lenses() {
    LensTerms plain;
    plain.active = true;
    plain.fold = 3;
    plain.ray_min = glm::dvec2(-0.7, -0.6);
    plain.ray_max = glm::dvec2(0.8, 0.5);
    LensTerms opencv = plain, full = plain, fisheye = plain, fov = plain, prism = plain,
              unified = plain, division = plain, aria = plain;
    opencv.k = {-0.2, 0.06, 0, 0};
    opencv.tangential = glm::dvec2(0.01, -0.015);
    full.k = {0.3, -0.1, 0.02, 0};
    full.d = {0.25, 0.05, -0.01};
    full.tangential = glm::dvec2(-0.02, 0.01);
    fisheye.front_tan = fisheye.front_scale = 1;
    fisheye.k = {0.05, -0.02, 0.004, -0.001};
    fov.front_scale = 0.9;
    fov.front_tan = 2 * std::tan(0.45);
    prism.front_tan = prism.front_scale = 1;
    prism.k = {-0.03, 0.01, -0.002, 0.0005};
    prism.tangential = glm::dvec2(0.004, 0.006);
    prism.prism = glm::dvec2(0.01, -0.02);
    aria.front_tan = aria.front_scale = 1;
    aria.k = {0.04, -0.03, 0.012, -0.006, 0.002, -0.0004};
    aria.after = true;
    aria.tangential = glm::dvec2(0.006, -0.004);
    aria.prism = glm::dvec2(-0.01, 0.015);
    aria.prism_high = glm::dvec2(0.008, -0.005);
    unified.front_scale = -0.6;  // -alpha
    unified.front_tan = 1.2;     // beta
    division.front_scale = -0.5;
    division.front_tan = -0.6;  // k = 0.15
    division.fold = 2.5;
    return {{"EUCM", unified},
            {"DIVISION", division},
            {"OPENCV", opencv},
            {"FULL_OPENCV", full},
            {"OPENCV_FISHEYE", fisheye},
            {"FOV", fov},
            {"THIN_PRISM_FISHEYE", prism},
            {"RAD_TAN_THIN_PRISM_FISHEYE", aria}};
}

}  // namespace darb::test
