// Photos from a video: the installed ffmpeg decodes it, the sharpest picture of each interval is
// kept.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace darb {

/// By the extension: .mp4, .mov and the like.
bool is_video_name(const std::filesystem::path& path);
/// All of these, with commas.
std::string video_extensions();

/// Sharpness of every picture of a video, in their order: the variance of the Laplacian of its
/// brightness at 480 x 270.
/// Throws Error: without ffmpeg with the Debian package, else with ffmpeg's own lines.
std::vector<double> video_sharpness(const std::filesystem::path& video);

/// The pictures to keep: of `wanted` intervals of equal length, or as many as there are pictures,
/// the sharpest of each, in order.
std::vector<std::size_t> sharpest_of_intervals(const std::vector<double>& sharpness,
                                               std::size_t wanted);

/// Writes these pictures of the video into a folder, which is made where it is missing, as
/// frame_00001.jpg and so on, upright. Throws Error as video_sharpness does.
void write_video_frames(const std::filesystem::path& video,
                        const std::vector<std::size_t>& pictures,
                        const std::filesystem::path& folder);

/// Variance of the Laplacian (4 neighbours) of a grey picture. Source: Pech-Pacheco et al.,
/// Diatom autofocusing in brightfield microscopy, 2000.
double laplacian_variance(const unsigned char* grey, int width, int height);

}  // namespace darb
