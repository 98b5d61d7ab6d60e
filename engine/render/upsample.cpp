#include "engine/render/upsample.h"

#include "engine/primitives/groups.h"
#include "engine/raster/frame_limit.h"
#include "shaders/shared/render_args.h"

namespace darb {

Camera resized(const Camera& camera, int width, int height) {
    const double sx = double(width) / camera.width, sy = double(height) / camera.height;
    Camera c = camera;
    c.fx *= sx;
    c.cx *= sx;
    c.fy *= sy;
    c.cy *= sy;
    c.width = width;
    c.height = height;
    return c;
}

Camera halved(const Camera& camera) {
    return resized(camera, (camera.width + 1) / 2, (camera.height + 1) / 2);
}

Upsample::Upsample(Device& device)
    : device_(&device), pipeline_(device, "upsample", {{"THREADS", SPLAT_GROUP}}) {}

const Buffer& Upsample::record(Commands& commands, const Buffer& image, const Camera& rendered,
                               const Camera& shown) {
    const std::uint64_t pixels = std::uint64_t(shown.width) * shown.height;
    check_frame(*device_, shown.width, shown.height);
    if (!image_ || image_.bytes() < pixels * 12)
        image_ = Buffer(*device_, "upsampled image", pixels * 12);
    const gpu::UpsampleArgs args{
        static_cast<std::uint32_t>(rendered.width), static_cast<std::uint32_t>(rendered.height),
        static_cast<std::uint32_t>(shown.width), static_cast<std::uint32_t>(shown.height)};
    const Groups g = groups_for(pixels);
    commands.pass("upsample");
    commands.dispatch(pipeline_, args, {image, image_}, g.x, g.y);
    return image_;
}

}  // namespace darb
