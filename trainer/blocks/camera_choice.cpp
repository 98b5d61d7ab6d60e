#include "trainer/blocks/camera_choice.h"

#include <algorithm>
#include <array>

#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr std::size_t kChannels = 3;
constexpr float kFull = static_cast<float>(0.5 / SH_C0);  // sh_dc of a channel at 1; less it, at 0

// The means of the channels of a picture.
std::array<double, kChannels> picture_means(const ImageF& picture) {
    std::array<double, kChannels> sum{};
    for (std::size_t i = 0; i < picture.data.size(); ++i) sum[i % kChannels] += picture.data[i];
    const double pixels = static_cast<double>(picture.data.size() / kChannels);
    for (double& s : sum) s /= pixels;
    return sum;
}

// Those that see most of it, kFewestViews at most; in order.
std::vector<std::size_t> best_views(const std::vector<std::vector<double>>& shares,
                                    std::size_t cell) {
    std::vector<std::size_t> best;
    for (std::size_t v = 0; v < shares.size(); ++v)
        if (shares[v][cell] > 0) best.push_back(v);
    std::stable_sort(best.begin(), best.end(), [&](std::size_t a, std::size_t b) {
        return shares[a][cell] > shares[b][cell];
    });
    best.resize(std::min(best.size(), kFewestViews));
    std::sort(best.begin(), best.end());
    return best;
}

}  // namespace

std::vector<std::vector<double>> cell_shares(Device& device, const SplatModel& coarse,
                                             const Partition& cells, const std::vector<View>& views,
                                             const ProjectionEffects& effects) {
    std::vector<std::vector<double>> shares(views.size());
    std::vector<std::size_t> cell(coarse.size());
    for (std::size_t i = 0; i < coarse.size(); ++i) cell[i] = cells.cell_of(position_of(coarse, i));
    SplatModel marked = coarse;
    limit_sh_degree(0, marked);
    for (std::size_t first = 0; first < cells.cells.size(); first += kChannels) {
        for (std::size_t i = 0; i < marked.size(); ++i)
            for (std::size_t c = 0; c < kChannels; ++c)
                marked.sh_dc[kChannels * i + c] = cell[i] == first + c ? kFull : -kFull;
        Renderer renderer(device, marked, Accuracy{}, effects);
        const std::size_t shown = std::min(kChannels, cells.cells.size() - first);
        for (std::size_t v = 0; v < views.size(); ++v) {
            const auto means = picture_means(renderer.render(views[v].camera));
            shares[v].insert(shares[v].end(), means.begin(), means.begin() + std::ptrdiff_t(shown));
        }
    }
    return shares;
}

std::vector<std::vector<std::size_t>> choose_views(const std::vector<std::vector<double>>& shares,
                                                   double least) {
    std::vector<std::vector<std::size_t>> chosen(shares.empty() ? 0 : shares.front().size());
    for (std::size_t v = 0; v < shares.size(); ++v) {
        const std::vector<double>& of = shares[v];
        const auto most = std::size_t(std::max_element(of.begin(), of.end()) - of.begin());
        for (std::size_t c = 0; c < of.size(); ++c)
            if (of[c] >= least || (c == most && of[c] > 0)) chosen[c].push_back(v);
    }
    for (std::size_t c = 0; c < chosen.size(); ++c)
        if (chosen[c].size() < kFewestViews) chosen[c] = best_views(shares, c);
    return chosen;
}

}  // namespace darb
