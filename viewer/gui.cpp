#include "viewer/gui.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include "engine/gpu/commands.h"

namespace darb {

namespace {

constexpr float kFontPx = 13;  // ProggyClean, Dear ImGui's own, is sharp at multiples of it

void check_gui(VkResult result) {
    check_vulkan(result, "panels");
}

}  // namespace

Gui::Gui(Device& device, VkRenderPass render_pass, float scale, GLFWwindow* window)
    : device_(device.handle()), windowed_(window != nullptr) {
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 16};
    VkDescriptorPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    pool.maxSets = 16;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    check_vulkan(vkCreateDescriptorPool(device_, &pool, nullptr, &pool_), "panels");

    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;  // leaves no file in the current folder
    ImFontConfig font;
    font_px_ = kFontPx * scale * (windowed_ ? pixels_per_unit(window) : 1);
    font.SizePixels = font_px_;
    io.Fonts->AddFontDefault(&font);
    set_scale(scale);
    if (windowed_) ImGui_ImplGlfw_InitForVulkan(window, true);

    ImGui_ImplVulkan_InitInfo info{};
    info.Instance = device.instance();
    info.PhysicalDevice = device.physical();
    info.Device = device_;
    info.QueueFamily = device.queue_family();
    info.Queue = device.queue();
    info.PipelineCache = device.pipeline_cache();
    info.DescriptorPool = pool_;
    info.MinImageCount = info.ImageCount = 2;
    info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
    info.CheckVkResultFn = check_gui;
    ImGui_ImplVulkan_Init(&info, render_pass);
    upload_fonts(device);
}

void Gui::set_scale(float scale) {
    ImGuiStyle& style = ImGui::GetStyle();
    style = ImGuiStyle();
    ImGui::StyleColorsDark();
    style.WindowRounding = 4;
    style.ScaleAllSizes(scale);
    ImGui::GetIO().FontGlobalScale = kFontPx * scale / font_px_;
}

float pixels_per_unit(GLFWwindow* window) {
    int px = 0, units = 0, unused = 0;
    glfwGetFramebufferSize(window, &px, &unused);
    glfwGetWindowSize(window, &units, &unused);
    return px > 0 && units > 0 ? static_cast<float>(px) / static_cast<float>(units) : 1;
}

// From 1.90 on the backend uploads them itself.
void Gui::upload_fonts([[maybe_unused]] Device& device) {
#if IMGUI_VERSION_NUM < 19000
    Commands commands(device);
    commands.begin();
    ImGui_ImplVulkan_CreateFontsTexture(commands.handle());
    commands.submit_and_wait();
    ImGui_ImplVulkan_DestroyFontUploadObjects();
#endif
}

Gui::~Gui() {
    vkDeviceWaitIdle(device_);
    ImGui_ImplVulkan_Shutdown();
    if (windowed_) ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    vkDestroyDescriptorPool(device_, pool_, nullptr);
}

void Gui::begin(int width, int height) {
    ImGui_ImplVulkan_NewFrame();
    if (windowed_) {
        ImGui_ImplGlfw_NewFrame();
    } else {
        ImGuiIO& io = ImGui::GetIO();
        io.DisplaySize = ImVec2(static_cast<float>(width), static_cast<float>(height));
        io.DeltaTime = 1.0f / 60;
    }
    ImGui::NewFrame();
}

void Gui::end() {
    ImGui::Render();
}

void Gui::draw(VkCommandBuffer commands) {
    ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands);
}

bool Gui::wants_mouse() const {
    return ImGui::GetIO().WantCaptureMouse;
}

bool Gui::wants_keys() const {
    return ImGui::GetIO().WantTextInput;
}

}  // namespace darb
