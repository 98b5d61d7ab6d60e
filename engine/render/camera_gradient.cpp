#include "engine/render/camera_gradient.h"

namespace darb {

CameraGradient camera_gradient(const Camera& camera, std::span<const float> shares,
                               std::span<const float> d_position) {
    CameraTotals sum{};
    for (std::size_t i = 0; i < shares.size(); ++i) sum[i % CAMERA_SHARES] += double(shares[i]);
    for (std::size_t i = 0; i < d_position.size(); ++i)
        sum[CAMERA_SHARES + i % 3] += double(d_position[i]);
    return camera_gradient(camera, sum);
}

CameraGradient camera_gradient(const Camera& camera, const CameraTotals& sum) {
    const glm::dvec3 d_centre(-sum[CAMERA_SHARES], -sum[CAMERA_SHARES + 1],
                              -sum[CAMERA_SHARES + 2]);

    // The centre is -R^-1 t: d(centre) = -R^-1 (dt + dR centre).
    CameraGradient g;
    g.d_translation = -(camera.rotation * d_centre);
    const glm::dvec3 centre = camera.centre();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            g.d_rotation[column][row] = sum[static_cast<std::size_t>(3 * row + column)] +
                                        g.d_translation[row] * centre[column];
    g.d_fx = sum[9];
    g.d_fy = sum[10];
    g.d_cx = sum[11];
    g.d_cy = sum[12];
    return g;
}

}  // namespace darb
