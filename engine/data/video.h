// Photos from a video: the installed ffmpeg decodes it, the sharpest picture of each interval is
// kept.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
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

/// FOLDER/NAME as ffmpeg takes it for the pictures of a sequence, where NAME has the %05d: from the
/// root, so that no name reads as an option or a protocol, and with the folder's own percent signs
/// written twice.
std::string picture_pattern(const std::filesystem::path& folder, const std::string& name);

/// The option by which this ffmpeg leaves out and repeats no picture, as its help (-h long) has it:
/// -fps_mode since 5.1, -vsync before that and up to 8.
std::string every_picture_option(std::string_view help);

/// Variance of the Laplacian (4 neighbours) of a grey picture. Source: Pech-Pacheco et al.,
/// Diatom autofocusing in brightfield microscopy, 2000.
double laplacian_variance(const unsigned char* grey, int width, int height);

}  // namespace darb
