#include "engine/raster/kernel_probe.h"

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "shaders/shared/kernel_probe_args.h"

namespace darb {

std::vector<KernelAnswer> probe_kernel(Device& device, const SpecConstants& constants,
                                       const std::vector<KernelProbe>& probes, float exponent) {
    const Pipeline pipeline(device, "kernel_probe", constants);
    Buffer input(device, "probes", probes.size() * sizeof(KernelProbe));
    Buffer output(device, "answers", probes.size() * sizeof(KernelAnswer));
    input.upload(probes);
    Commands commands(device);
    commands.begin();
    const auto count = static_cast<std::uint32_t>(probes.size());
    commands.dispatch(pipeline, gpu::KernelProbeArgs{count, exponent}, {input, output},
                      (count + KERNEL_PROBE_GROUP - 1) / KERNEL_PROBE_GROUP);
    commands.submit_and_wait();
    return output.download<KernelAnswer>(probes.size());
}

}  // namespace darb
