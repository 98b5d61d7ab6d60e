#include "tools/darb/probe_arms.h"

#include <algorithm>
#include <chrono>
#include <memory>

#include "trainer/growth/initial_model.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

constexpr int kTurn = 10;  // iterations

}  // namespace

std::vector<Arm> train_arms(Device& device, const Dataset& dataset,
                            const std::vector<ImageU8>& photos,
                            const std::vector<TrainOptions>& options) {
    std::vector<std::unique_ptr<Trainer>> trainers;
    for (const TrainOptions& one : options)
        trainers.push_back(
            std::make_unique<Trainer>(device, dataset, photos, initial_model(dataset, one), one));
    std::vector<Arm> arms(options.size());
    for (int turn = 0; turn * kTurn < options.front().iterations; ++turn)
        for (std::size_t k = 0; k < arms.size(); ++k) {
            const std::size_t i = turn % 2 == 0 ? k : arms.size() - 1 - k;
            const int end = std::min((turn + 1) * kTurn, options[i].iterations);
            const auto start = std::chrono::steady_clock::now();
            while (trainers[i]->iteration() < end) trainers[i]->step();
            trainers[i]->drain();
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
            if (turn > 0 || end == options[i].iterations) arms[i].turns_s.push_back(took.count());
        }
    for (std::size_t i = 0; i < arms.size(); ++i) {
        arms[i].model = trainers[i]->model();
        for (const double s : arms[i].turns_s) arms[i].run.seconds += s;
        arms[i].run.splats = arms[i].model.size();
    }
    return arms;
}

double price_of(const Arm& one, const Arm& other) {
    std::vector<double> ratios;
    for (std::size_t t = 0; t < one.turns_s.size(); ++t)
        ratios.push_back(other.turns_s[t] / one.turns_s[t]);
    std::ranges::sort(ratios);
    const std::size_t n = ratios.size();
    return (ratios[(n - 1) / 2] + ratios[n / 2]) / 2 - 1;
}

}  // namespace darb
