// SPDX-License-Identifier: MIT
// Photos from a video: the installed ffmpeg decodes it, and the sharpest picture of each interval
// is kept.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

/// Whether the extension is that of a video: .mp4, .mov and the like.
bool is_video_name(const std::filesystem::path& path);
/// All such extensions, separated by commas.
std::string video_extensions();

/// The sharpness of every picture of a video, in order: the variance of the Laplacian of its
/// brightness at 480 x 270. Throws Error that names the Debian package where ffmpeg is not
/// installed, else with ffmpeg's own lines.
std::vector<double> video_sharpness(const std::filesystem::path& video);

/// The pictures to keep, in order: the sharpest in each of `wanted` intervals of equal length, or
/// every picture where there are no more than that.
std::vector<std::size_t> sharpest_of_intervals(const std::vector<double>& sharpness,
                                               std::size_t wanted);

/// Writes these pictures of the video, upright, as frame_00001.jpg and so on into a folder, which
/// is made where missing. Throws Error as video_sharpness does.
void write_video_frames(const std::filesystem::path& video,
                        const std::vector<std::size_t>& pictures,
                        const std::filesystem::path& folder);

/// FOLDER/NAME, where NAME contains %05d, as ffmpeg takes it for the pictures of a sequence: an
/// absolute path, so that no name reads as an option or a protocol, with percent signs of the
/// folder doubled.
std::string picture_pattern(const std::filesystem::path& folder, const std::string& name);

/// The option that keeps this ffmpeg from dropping or repeating pictures, found in its help (-h
/// long): -fps_mode since 5.1, -vsync before that and up to 8.
std::string every_picture_option(std::string_view help);

/// Variance of the Laplacian (4 neighbours) of a grey picture. Source: Pech-Pacheco et al.,
/// Diatom autofocusing in brightfield microscopy, 2000.
double laplacian_variance(const unsigned char* grey, int width, int height);

}  // namespace darb
