#include "tools/bench/bench_step.h"

#include "engine/core/rng.h"

namespace darb {

namespace {

ForwardOptions training_options() {
    ForwardOptions options;
    options.store_for_backward = true;
    return options;
}

// Rates that leave the scene as it is to the eye, whatever the number of samples.
AdamStep small_step() {
    AdamStep rates;
    rates.rate.fill(1e-7f);
    rates.clearance = 0.1f;
    return adam_step(rates, 1000);
}

std::uint64_t pixels_of(const Camera& camera) {
    return std::uint64_t(camera.width) * std::uint64_t(camera.height);
}

}  // namespace

BenchStep::BenchStep(Device& device, const SplatModel& model, const Camera& camera)
    : sh_degree_(model.sh_degree),
      buffers_(device, training_options()),
      forward_(device, training_options()),
      backward_(device, training_options()),
      loss_(device, camera.width, camera.height),
      update_(device),
      commands_(device),
      fused_(device, model, true),
      apart_(device, model, true),
      gradients_(device, apart_),
      view_{camera_data(camera, model.origin), &cameras_, 0, sh_degree_, glm::vec3(0)},
      cameras_(upload_cameras(device, {view_.camera})),
      photo_(device, "photo", pixels_of(camera) * 4),
      d_image_(device, "d_image", pixels_of(camera) * 12),
      result_(device, "loss", sizeof(gpu::LossResult)) {
    Pcg32 random(5, 6);
    std::vector<std::uint32_t> photo(pixels_of(camera));
    for (std::uint32_t& pixel : photo) pixel = random.next() | 0xFF000000u;
    photo_.upload(photo);
    buffers_.reserve(fused_.count(), fused_.count() * 4, camera.width, camera.height);
    for (const bool apart : {false, true}) run(apart);  // buffers grow
}

std::vector<PassTime> BenchStep::run(bool apart) {
    GpuSplats& splats = apart ? apart_ : fused_;
    Frame& frame = buffers_.frame();
    do {
        backward_.reserve(splats.count(), frame.size.intersections, frame.checkpoint_records());
        commands_.begin();
        forward_.record(commands_, splats, view_, frame);
        loss_.record(commands_, {frame.images.image, photo_, d_image_, result_},
                     static_cast<int>(view_.camera.width), static_cast<int>(view_.camera.height),
                     view_.background);
        apart ? record_apart(splats)
              : backward_.record(commands_, view_, frame, splats, d_image_, small_step());
        commands_.submit_and_wait();
        status_ = frame.read_status();
    } while (buffers_.make_room(status_));
    return commands_.pass_times();
}

void BenchStep::record_apart(GpuSplats& splats) {
    const Frame& frame = buffers_.frame();
    const Buffer& status = frame.counters.status;
    backward_.record_gradients(commands_, view_, frame, splats, d_image_, {gradients_});
    update_.record(commands_, splats, gradients_, status, sh_degree_, small_step());
    update_.record_fading(commands_, splats, gradients_, status, view_, small_step().clearance);
    update_.record_sums(commands_, gradients_, status, backward_.gradient_sum());
}

}  // namespace darb
