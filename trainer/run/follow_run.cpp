// SPDX-License-Identifier: MIT
#include "trainer/run/follow_run.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/memory.h"
#include "engine/plan/tuning_names.h"
#include "trainer/growth/initial_model.h"

namespace darb {

namespace {
constexpr int kStepsBetweenLooks = 64;  // from one look whether ranks are equal to the next
}  // namespace

std::optional<Checkpoint> checkpoint_of(Device& device, const RunOptions& run) {
    const std::filesystem::path& path = run.resume_from;
    const bool reads = !run.ranks.several() || run.ranks.all->is_first();
    Bytes file;
    if (reads && !path.empty()) file = read_file(path);
    if (run.ranks.several()) file = from_first(*run.ranks.all, file);
    if (file.empty() && (path.empty() || !reads)) return std::nullopt;
    Checkpoint checkpoint =
        while_doing(path.string(), [&] { return parse_checkpoint(file, path.string()); });
    device.set_tuning(
        resumed_tuning(device.info(), device.tuning(), checkpoint.tuning, path.string()));
    return checkpoint;
}

SplatModel first_model(const Dataset& dataset, const Schedule& schedule,
                       const std::optional<Checkpoint>& checkpoint, const SplatModel* given) {
    SplatModel model = given ? *given : initial_model(dataset, schedule);
    if (checkpoint) model.origin = checkpoint->state.model.origin;
    return model;
}

void check_ranks(const Device& device, const Schedule& schedule, const RankGroup& ranks,
                 const std::string& fingerprint) {
    if (!ranks.several()) return;
    RankFacts facts = ranks.mixed ? rank_facts() : rank_facts(device);
    facts.insert(facts.begin(), {"option --allow-mixed", ranks.mixed ? "on" : "off"});
    facts.emplace_back("data set", fingerprint);
    facts.emplace_back("settings", settings_text(schedule));
    check_same(*ranks.all, facts);
}

bool is_to_stop(Trainer& trainer, const RankGroup& ranks, bool stop) {
    if (!ranks.several()) return stop;
    const int steps = trainer.iteration() / trainer.views_a_step();
    if (!ranks.mixed && steps % kStepsBetweenLooks == 0)
        check_equal_splats(*ranks.all, trainer.splats(), trainer.iteration());
    return any_stops(*ranks.all, stop);
}

std::vector<ImageU8> photos_of_run(const Dataset& dataset, const TrainOptions& options,
                                   std::vector<ImageU8> loaded) {
    std::vector<ImageU8> photos = loaded.empty() ? load_photos(dataset.views) : std::move(loaded);
    if (options.alpha) return photos;
    for (ImageU8& photo : photos)
        if (photo.channels == 4)
            for (std::size_t a = 3; a < photo.data.size(); a += 4) photo.data[a] = 255;
    return photos;
}

TrainResult follow_training(Device& device, const Dataset& dataset, const Schedule& schedule,
                            const RunOptions& run, const std::atomic<bool>* stop,
                            std::vector<ImageU8> photos) {
    check_gain_watch(dataset, schedule.options, run.ranks);
    photos = photos_of_run(dataset, schedule.options, std::move(photos));
    photo_doubts(dataset, photos);  // throws; the first rank says them
    const std::string fingerprint = dataset_fingerprint(dataset, photos);
    const std::optional<Checkpoint> checkpoint = checkpoint_of(device, run);
    Trainer trainer(device, dataset, photos, first_model(dataset, schedule, checkpoint), schedule,
                    run.ranks);
    photos = {};  // they are where steps read them
    give_back_freed_memory();
    check_ranks(device, schedule, run.ranks, fingerprint);
    if (checkpoint) {
        check_resumable(*checkpoint, run.resume_from, schedule, dataset, fingerprint);
        trainer.restore(checkpoint->state);
    }
    while (trainer.iteration() < schedule.iterations &&
           !is_to_stop(trainer, run.ranks, stop && stop->load()))
        while_doing(fmt::format("iteration {}", trainer.iteration() + 1), [&] { trainer.step(); });
    TrainResult summary;
    summary.iteration = trainer.iteration();
    summary.interrupted = trainer.iteration() < schedule.iterations;
    return summary;
}

}  // namespace darb
