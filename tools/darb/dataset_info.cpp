#include "tools/darb/dataset_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "engine/data/camera_list.h"

namespace darb {

namespace {

using nlohmann::json;

// A data set, or a camera list as one without photos and points.
Dataset open(const std::filesystem::path& path, const DatasetOptions& options) {
    const bool is_file = std::filesystem::is_regular_file(path);
    std::vector<View> views;
    if (is_file) views = load_cameras(path, options);
    if (views.empty() || !views[0].photo.empty()) return load_dataset(path, options);
    Dataset dataset;
    dataset.root = path;
    dataset.source = "cameras.json";
    dataset.views = std::move(views);
    return dataset;
}

json count_sizes(const Dataset& dataset) {
    std::map<std::pair<int, int>, size_t> counts;
    for (const View& view : dataset.views) ++counts[{view.camera.width, view.camera.height}];
    json list = json::array();
    for (const auto& [size, count] : counts)
        list.push_back({{"width", size.first}, {"height", size.second}, {"views", count}});
    return list;
}

json count_lenses(const Dataset& dataset) {
    std::map<std::tuple<std::string, int, int>, size_t> counts;
    for (const View& view : dataset.views)
        ++counts[{view.lens.model, view.lens.width, view.lens.height}];
    json list = json::array();
    for (const auto& [lens, count] : counts)
        list.push_back({{"model", std::get<0>(lens)},
                        {"width", std::get<1>(lens)},
                        {"height", std::get<2>(lens)},
                        {"views", count}});
    return list;
}

}  // namespace

json dataset_info(const std::filesystem::path& path, const DatasetOptions& options) {
    const Dataset dataset = open(path, options);
    const auto test = std::count_if(dataset.views.begin(), dataset.views.end(),
                                    [](const View& view) { return view.is_test; });
    return {{"path", path.string()},
            {"source", dataset.source},
            {"views", dataset.views.size()},
            {"train", dataset.views.size() - static_cast<size_t>(test)},
            {"test", test},
            {"sizes", count_sizes(dataset)},
            {"lenses", count_lenses(dataset)},
            {"points", dataset.points.size()},
            {"extent", scene_extent(dataset)},
            {"has_alpha", dataset.has_alpha},
            {"notes", dataset.notes}};
}

}  // namespace darb
