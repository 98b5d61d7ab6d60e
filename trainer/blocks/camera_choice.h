// Which cameras a block is trained on: those in whose pictures the splats of its cell, in the
// coarse model of the whole, make up enough.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/raster/effects.h"
#include "engine/scene/splat_model.h"
#include "trainer/blocks/partition.h"

namespace darb {

/// Share of a picture from which on its camera sees a cell enough.
constexpr double kLeastShare = 0.05;
/// A cell that fewer see enough gets those that see most of it.
constexpr std::size_t kFewestViews = 3;

/// [view][cell]: the mean over the picture of sum alpha T over the splats of the cell, which is
/// what they contribute. Three cells a picture: their splats are drawn red, green and blue, the
/// others black.
std::vector<std::vector<double>> cell_shares(Device& device, const SplatModel& coarse,
                                             const Partition& cells, const std::vector<View>& views,
                                             const ProjectionEffects& effects);

/// [cell] the views, ascending, that show at least `least` of it, and of each view the cell that it
/// shows most of; fewer than kFewestViews only where fewer show any of it.
std::vector<std::vector<std::size_t>> choose_views(const std::vector<std::vector<double>>& shares,
                                                   double least = kLeastShare);

}  // namespace darb
