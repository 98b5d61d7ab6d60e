// darb cost --train DATASET: what each accuracy setting costs and changes in training.

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/gpu/device_environment.h"
#include "tools/cost/train_cost.h"
#include "tools/darb/cost_flags.h"
#include "tools/darb/json_output.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "trainer/job/job.h"

namespace darb {

int train_cost(Ranks& ranks, const CostFlags& flags) {
    if (!flags.scene.empty())
        throw Error("darb cost " + flags.scene + " --train " + flags.train,
                    "--train takes no scene: it trains its own", "Leave the scene out.");
    int iterations = flags.quick ? 300 : flags.full ? 7'000 : 1'500;
    if (flags.iterations > 0) iterations = flags.iterations;
    std::vector<std::string> words{flags.train, "-o",       ".",
                                   "--eval",    "--images", flags.data.images_folder};
    words.push_back(fmt::format("--iterations={}", iterations));
    if (flags.data.resolution != DatasetOptions{}.resolution)
        words.push_back(fmt::format("--resolution={}", flags.data.resolution));
    if (flags.data.hold_out) words.push_back("--hold-out=" + hold_out_text(flags.data.held_out));
    if (flags.white_background) words.emplace_back("--white-background");
    const TrainRequest request = parse_train_words(words, flags.train_options, "darb cost --train");
    if (request.train.accuracy != Accuracy{})
        throw Error("--train-options " + flags.train_options,
                    "sets the accuracy, which each row of the measurement sets itself",
                    "Leave it out; the rows fast and exact are among them.");
    TrainCostPlan plan;
    plan.ranks = &ranks;
    plan.seeds = flags.quick ? 1 : flags.full ? 5 : 3;
    if (flags.seeds > 0) plan.seeds = flags.seeds;
    Dataset dataset = load_dataset(request.dataset, request.data);
    say_notes(dataset.notes);
    refuse_to_overwrite_inputs({flags.json, flags.html},
                               together({files_of(flags.train), files_of(dataset.views)}));
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    TrainJob job = resolve(request, std::move(dataset));
    for (const std::string& note : job.notes) say_note("note: " + note);
    find_start(device, job, say_stereo_begins);
    say_note("effects: " + plan_line(job.effects));
    if (!job.start_note.empty()) say_note(job.start_note);
    TrainCostResult result = measure_train_cost(device, job.dataset, job.options, plan, say_note);
    if (!ranks.is_first()) return 0;
    result.dataset = name_in_json(flags.json, flags.train);
    write_json(flags.json, train_cost_json(result));
    result.dataset = name_in_json(flags.html, flags.train);
    if (!flags.html.empty()) write_file_atomic(flags.html, train_cost_html(result));
    tell(stream_beside_json(flags.json, flags.quiet), "{}: iterations {}, seeds {}, {}\n\n{}",
         flags.train, result.iterations, result.seeds, result.device, train_cost_table(result));
    tell_paths(flags.quiet, {flags.json, flags.html});
    return 0;
}

}  // namespace darb
