// SPDX-License-Identifier: MIT
// What the readers of sources share with load_dataset. Internal to engine/data.
#pragma once

#include <array>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/data/dataset.h"

namespace darb {

/// Readers fill in points, notes and, in each view, name, photo, mask, lens (as declared), is_test,
/// camera.rotation and camera.translation. Views come in any order.
Dataset load_colmap(const std::filesystem::path& root, const std::filesystem::path& model_folder,
                    const DatasetOptions& options);
/// The first of these that a folder has is read; the views of the last are all test views.
inline constexpr std::array kTransformsFiles{"transforms_train.json", "transforms.json",
                                             "transforms_test.json"};
/// path: a .json file, or a folder with one of the above.
Dataset load_transforms(const std::filesystem::path& path, const DatasetOptions& options);

/// Throw Error: what the file or folder that holds no cameras is, and how to get a data set from
/// it.
[[noreturn]] void refuse_file(const std::filesystem::path& file);
[[noreturn]] void refuse_folder(const std::filesystem::path& folder);

/// Reads the head of every photo, decides on EXIF orientation, scales declared lenses to the
/// photos' sizes (with a note), and sets each camera's intrinsics to what load_photo returns.
/// Throws Error naming the photo where its aspect ratio differs from the camera's. Where a photo
/// does not exist, the declared size stays.
void fit_views(Dataset& dataset, const DatasetOptions& options);

/// Leaves out views whose camera stands so far from the others that it sees the scene as a dot or
/// not at all, with a warning that names them. They would ruin the scale of everything that follows
/// the cameras (rates, sizes, near and far), and training on them costs quality, too. Where only
/// cameras are wanted, it just warns. Call it before views are fitted and tracks are indexed; needs
/// dataset.options.
void leave_out_far_cameras(Dataset& dataset);

/// Adds notes on cameras that see none of the points, and on implausible intrinsics.
void note_odd_cameras(Dataset& dataset);
/// Adds a note where the points are float32 numbers far from 0, and therefore coarse.
void note_coarse_points(Dataset& dataset);

/// Turns an image that belongs to the photo's pixels (a mask or depths; `kind` names it) as
/// load_photo turns the photo. It may have been made for the stored pixels or for the photo as
/// viewers show it; its shape tells which. Throws Error where its shape differs from that of
/// view.lens.
ImageU8 turn_with_photo(ImageU8 image, const View& view, const std::filesystem::path& file,
                        const char* kind);

/// The size at which a width x height photo is loaded with DatasetOptions::resolution.
struct PhotoSize {
    int width = 0, height = 0;
};
PhotoSize size_at_resolution(int width, int height, int resolution);

/// `path` without "." parts and without a slash at its end, so that parent_path and filename mean
/// the folder. A bare "." stays.
std::filesystem::path tidy_path(const std::filesystem::path& path);

/// The name with slashes for backslashes, because writers on Windows use backslashes.
std::string with_slashes(std::string name);

/// folder / name as it is, else with slashes for backslashes, else with another of the usual
/// extensions in place of its own (or added, where its own is not that of a picture). Where the
/// named file has a format that cannot be read, one with another extension is taken as well. Empty
/// where there is none.
std::filesystem::path find_photo(const std::filesystem::path& folder, const std::string& name);

/// As find_photo, but by the end of the name, as much of it as exists in the folder: names may come
/// from another machine (C:\\photos\\a.png, /home/me/photos/a.png) or repeat the folder
/// (images/a.png).
std::filesystem::path find_by_end(const std::filesystem::path& folder, const std::string& name);

std::string lower_case(std::string text);

/// The folders in `parent`, sorted by name, without hidden ones.
std::vector<std::filesystem::path> folders_of(const std::filesystem::path& parent);

/// A list, for a note, of folders with files whose lower-case names contain one of the words: these
/// may have been meant for masks or depths. Empty where there is none.
std::string unused_folders(const std::vector<std::filesystem::path>& parents,
                           std::initializer_list<std::string_view> words);

/// The usual folder of photos, with which their names in transforms.json begin.
constexpr std::string_view kImages = "images/";
/// The name without that beginning.
std::string without_images(const std::string& name);

/// The first folder in `folder` named images_2 or the like; empty where there is none.
std::string scaled_images(const std::filesystem::path& folder);

}  // namespace darb
