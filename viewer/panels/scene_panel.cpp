// What is open, and how it is displayed.
#include <imgui.h>

#include <string>
#include <vector>

#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/splat_file.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

void kernel_choice(Session& s) {
    DisplaySettings& d = s.display;
    const std::string now(kernel_name(d.kernel));
    if (ImGui::BeginCombo("kernel", now.c_str())) {
        std::vector<int> kernels = known_kernels();
        if (kernel_has_shape(s.own.kernel)) kernels.push_back(s.own.kernel);
        for (const int k : kernels) {
            const std::string name(kernel_name(k));
            if (ImGui::Selectable(name.c_str(), k == d.kernel)) d.kernel = k;
        }
        ImGui::EndCombo();
    }
    tip("the profile that all splats are drawn with");
    int footprint = d.footprint == Footprint::exact ? 1 : 0;
    ImGui::BeginDisabled(!has_exact_footprint(d.kernel));
    if (ImGui::Combo("footprint", &footprint, "psi\0exact\0"))
        d.footprint = footprint == 1 ? Footprint::exact : Footprint::psi;
    ImGui::EndDisabled();
    tip("how a splat is projected: psi, a fitted Gaussian-like curve, or the exact line integral "
        "where the kernel has one");
    if (!s.scene) return;
    const SplatModel& m = s.scene->model;
    if (m.kernel == d.kernel && m.footprint == d.footprint) return;
    ImGui::TextWrapped("The scene was trained with %s, %s.",
                       std::string(kernel_name(m.kernel)).c_str(),
                       std::string(footprint_name(m.footprint)).c_str());
    if (ImGui::Button("Back to the scene's own")) {
        d.kernel = m.kernel;
        d.footprint = m.footprint;
    }
    tip("kernel and footprint of the file");
}

}  // namespace

void scene_panel(Session& s) {
    if (!s.training.live || s.training.finished) {
        if (ImGui::Button("Open ...")) s.ask(request::ShowOpen{});
        tip("a scene of a folder, or one that was opened before, Ctrl+O");
    }
    if (!s.scene || !ImGui::CollapsingHeader("Scene", ImGuiTreeNodeFlags_DefaultOpen)) return;
    const Scene& scene = *s.scene;
    ImGui::TextWrapped("%s", scene_name(scene.file, true).c_str());
    tip(scene.file.string().c_str());
    ImGui::Text("%zu splats, SH degree %d", scene.model.size() - s.edit.removed_count(),
                scene.model.sh_degree);
    ImGui::Text("%s, loaded in %.2f s", scene.format.c_str(), scene.load_s);
    for (const std::string& note : scene.notes) ImGui::TextWrapped("%s", note.c_str());
}

void display_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Display", ImGuiTreeNodeFlags_DefaultOpen)) return;
    DisplaySettings& d = s.display;
    constexpr const char* kModes[] = {"picture", "error to photo", "depth", "work per pixel"};
    if (ImGui::BeginCombo("show", kModes[d.mode])) {
        for (int m = 0; m < 4; ++m) {
            if (m == VIEW_ERROR && s.photos.current < 0) continue;
            if (ImGui::Selectable(kModes[m], m == d.mode)) d.mode = m;
        }
        ImGui::EndCombo();
    }
    tip("the picture; its error to the photo, as heat; depth, near is light; or how many splats "
        "each pixel takes");
    if (d.mode == VIEW_ERROR) {
        ImGui::SliderFloat("hottest at", &d.error_max, 0.02f, 1.0f, "%.2f of white", kLogarithmic);
        tip("mean absolute difference of the three channels");
    }
    if (d.mode == VIEW_COUNT) {
        ImGui::SliderFloat("hottest at", &d.count_max, 10, 10'000, "%.0f splats", kLogarithmic);
        tip("of a pixel's list, until it is opaque");
    }
    if (s.scene) {
        int style = static_cast<int>(d.style);
        if (ImGui::Combo("splats as", &style, "splats\0points\0ellipsoids\0"))
            d.style = static_cast<SplatStyle>(style);
        tip("as they are; dots at their centres; or hard ellipses of two standard deviations");
    }
    kernel_choice(s);
    panes_panel(s);
    ImGui::ColorEdit3("background", &d.background.x);
    tip("sRGB, what is seen where no splat is");
}

}  // namespace darb
