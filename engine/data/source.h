// Between the readers of a source and load_dataset. Internal to engine/data.
#pragma once

#include <array>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// Readers fill name, photo, mask, lens (as declared), is_test and the pose in camera.rotation and
/// camera.translation; points; notes. Views come in any order.
Dataset load_colmap(const std::filesystem::path& root, const std::filesystem::path& model_folder,
                    const DatasetOptions& options);
/// Of which a folder's first is read; the last one's views are all test.
inline constexpr std::array kTransformsFiles{"transforms_train.json", "transforms.json",
                                             "transforms_test.json"};
/// path: a .json file, or a folder with one of these.
Dataset load_transforms(const std::filesystem::path& path, const DatasetOptions& options);

/// Throw Error: what the file or folder is that holds no cameras, and the way to a data set.
[[noreturn]] void refuse_file(const std::filesystem::path& file);
[[noreturn]] void refuse_folder(const std::filesystem::path& folder);

/// Reads the head of every photo, decides on EXIF, scales declared lenses to the photos' sizes
/// (with a note), and sets each camera's intrinsics to what load_photo returns. Throws Error naming
/// the photo where its aspect ratio is not the camera's. Photos that do not exist keep declared
/// sizes.
void fit_views(Dataset& dataset, const DatasetOptions& options);

/// Leaves out views whose camera stands so far outside of the place of the others that it sees the
/// scene as a dot or not at all, with a warning that names them: they ruin the scale of everything
/// that follows the cameras (rates, sizes, near and far), and training on them costs quality, too.
/// Where only cameras are wanted there is the warning alone. Before views are fitted and tracks are
/// indexed; needs dataset.options.
void leave_out_far_cameras(Dataset& dataset);

/// Notes on cameras that see none of the points, and on intrinsics beyond reason.
void note_odd_cameras(Dataset& dataset);
/// A note where points are float32 numbers that lie far from 0, and coarse there.
void note_coarse_points(Dataset& dataset);

/// An image made of the photo's pixels (a mask, depths; `kind`), turned as load_photo turns the
/// photo: it may be of the stored pixels or of the photo as viewers show it, and its shape tells
/// which. Throws Error where it has another shape than the photo, of view.lens.
ImageU8 turn_with_photo(ImageU8 image, const View& view, const std::filesystem::path& file,
                        const char* kind);

/// Size at which a width x height photo is loaded: DatasetOptions::resolution.
struct PhotoSize {
    int width = 0, height = 0;
};
PhotoSize size_at_resolution(int width, int height, int resolution);

/// `path` without "." parts and a slash at its end, so that parent_path and filename mean the
/// folder. "." stays.
std::filesystem::path tidy_path(const std::filesystem::path& path);

/// Writers on Windows separate folders by backslashes.
std::string with_slashes(std::string name);

/// folder / name as it is, else with slashes for backslashes, else with another of the usual
/// extensions in place of its own (or added, where it is no picture's); so, too, where it is of a
/// format that is not read, the file of another extension being one. Empty where there is none.
std::filesystem::path find_photo(const std::filesystem::path& folder, const std::string& name);

/// As find_photo, by the end of the name, as much of it as is there: names may be those of another
/// machine (C:\\photos\\a.png, /home/me/photos/a.png) or repeat the folder (images/a.png).
std::filesystem::path find_by_end(const std::filesystem::path& folder, const std::string& name);

std::string lower_case(std::string text);

/// The folders in it, by name, without hidden ones.
std::vector<std::filesystem::path> folders_of(const std::filesystem::path& parent);

/// A list, for a note, of folders with files whose names contain one of the words, in lower case:
/// what may have been meant for masks or depths. Empty where there is none.
std::string unused_folders(const std::vector<std::filesystem::path>& parents,
                           std::initializer_list<std::string_view> words);

/// The usual folder of photos, as it begins their names in transforms.json.
constexpr std::string_view kImages = "images/";
/// A name without it.
std::string without_images(const std::string& name);

/// The first folder images_* in `folder`, images_2 or the like; empty where there is none.
std::string scaled_images(const std::filesystem::path& folder);

/// Pluralised count for notes: "1 photo", "3 photos".
std::string counted(std::size_t count, const char* noun);

}  // namespace darb
