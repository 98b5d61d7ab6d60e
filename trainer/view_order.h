// ViewOrder: which view an iteration trains on. Each epoch goes through all training views once, in
// an order that the seed and the epoch's number draw.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "engine/core/rng.h"

namespace darb {

class ViewOrder {
  public:
    /// views: at least one.
    ViewOrder(std::vector<int> views, std::uint64_t seed) : views_(std::move(views)), seed_(seed) {}

    /// The view of an iteration, from 1. Any order of calls gives the same answers; those of one
    /// epoch after each other are cheap.
    int view(int iteration) {
        const int count = static_cast<int>(views_.size());
        const int epoch = (iteration - 1) / count;
        if (epoch != epoch_) shuffle(epoch);
        return order_[(iteration - 1) % count];
    }

  private:
    void shuffle(int epoch) {
        order_ = views_;
        Pcg32 random(seed_, 1000 + static_cast<std::uint64_t>(epoch));
        for (int i = static_cast<int>(order_.size()) - 1; i > 0; --i)
            std::swap(order_[i], order_[random.below(i + 1)]);
        epoch_ = epoch;
    }

    std::vector<int> views_, order_;  // order_: of this epoch
    std::uint64_t seed_;
    int epoch_ = -1;
};

}  // namespace darb
