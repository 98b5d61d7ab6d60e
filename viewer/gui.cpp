// SPDX-License-Identifier: MIT
#include "viewer/gui.h"

#include <imgui.h>
#include <algorithm>
#include <cmath>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include <cmath>

#include "engine/gpu/commands.h"
#include "viewer/canvas.h"
#include "viewer/gui_font.h"

namespace darb {

namespace {

constexpr float kFontPx = 15;  // at scale 1
// ProggyClean, Dear ImGui's own font, is sharp at multiples of this
constexpr float kOwnFontPx = 13;
constexpr float kLargePx = 24;  // from here on letters need no oversampling

// The letters that file names may have: Latin with its extensions, Greek, Cyrillic, punctuation.
constexpr ImWchar kLetters[] = {0x20,   0x17F,  0x370,  0x3FF,  0x400,  0x52F, 0x2010,
                                0x2027, 0x2030, 0x203A, 0x20AC, 0x20AC, 0};

void check_gui(VkResult result) {
    check_vulkan(result, "panels");
}

void make_font(float px) {
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    fonts.Clear();
    const std::span<const unsigned char> file = gui_font();
    ImFontConfig config;
    config.SizePixels = px * (file.empty() ? kOwnFontPx / kFontPx : 1);
    config.FontDataOwnedByAtlas = false;
    config.OversampleH = px < kLargePx ? 2 : 1;
    config.RasterizerMultiply = 1.1f;  // light letters on a dark ground look thin
    if (file.empty())
        fonts.AddFontDefault(&config);
    else
        fonts.AddFontFromMemoryTTF(const_cast<unsigned char*>(file.data()),
                                   static_cast<int>(file.size()), config.SizePixels, &config,
                                   kLetters);
}

}  // namespace

Gui::Gui(Device& device, VkRenderPass render_pass, float scale, GLFWwindow* window)
    : device_(&device), render_pass_(render_pass), window_(window) {
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 16};
    VkDescriptorPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    pool.maxSets = 16;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    check_vulkan(vkCreateDescriptorPool(device.handle(), &pool, nullptr, &pool_), "panels");

    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;  // keeps Dear ImGui from writing a file into the current folder
    if (window_ != nullptr) ImGui_ImplGlfw_InitForVulkan(window_, true);
    set_scale(scale);
}

void Gui::start_backend() {
    ImGui_ImplVulkan_InitInfo info{};
    info.Instance = device_->instance();
    info.PhysicalDevice = device_->physical();
    info.Device = device_->handle();
    info.QueueFamily = device_->queue_family();
    info.Queue = device_->queue();
    info.PipelineCache = device_->pipeline_cache();
    info.DescriptorPool = pool_;
    // how many sets of buffers the backend keeps
    info.MinImageCount = info.ImageCount = kFramesUnderWay;
    info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
    info.CheckVkResultFn = check_gui;
    ImGui_ImplVulkan_Init(&info, render_pass_);
}

// The backend frees the previous texture of the letters when it ends, and not earlier.
void Gui::set_scale(float scale) {
    apply_theme(scale);
    if (ImGui::GetIO().BackendRendererUserData != nullptr) {
        device_->wait_idle();
        ImGui_ImplVulkan_Shutdown();
    }
    make_font(std::round(kFontPx * scale));
    start_backend();
    upload_fonts();
}

float pixels_per_unit(GLFWwindow* window) {
    int px = 0, units = 0, unused = 0;
    glfwGetFramebufferSize(window, &px, &unused);
    glfwGetWindowSize(window, &units, &unused);
    return px > 0 && units > 0 ? static_cast<float>(px) / static_cast<float>(units) : 1;
}

// The backend reports size and pointer in the window's units.
void Gui::use_pixels(int width, int height) const {
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = ImVec2(static_cast<float>(width), static_cast<float>(height));
    io.DisplayFramebufferScale = ImVec2(1, 1);
    const float density = window_ != nullptr ? pixels_per_unit(window_) : 1;
    if (density == 1) return;
#if IMGUI_VERSION_NUM < 18700
    if (ImGui::IsMousePosValid(&io.MousePos))
        io.MousePos = ImVec2(io.MousePos.x * density, io.MousePos.y * density);
#else
    double x = 0, y = 0;
    glfwGetCursorPos(window_, &x, &y);
    if (glfwGetWindowAttrib(window_, GLFW_HOVERED) == GLFW_TRUE)
        io.AddMousePosEvent(static_cast<float>(x) * density, static_cast<float>(y) * density);
#endif
}

// From 1.90 on the backend uploads the fonts itself.
void Gui::upload_fonts() {
#if IMGUI_VERSION_NUM < 19000
    Commands commands(*device_);
    commands.begin();
    ImGui_ImplVulkan_CreateFontsTexture(commands.handle());
    commands.submit_and_wait();
    ImGui_ImplVulkan_DestroyFontUploadObjects();
#endif
}

Gui::~Gui() {
    finish_quietly(*device_);
    ImGui_ImplVulkan_Shutdown();
    if (window_ != nullptr) ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    vkDestroyDescriptorPool(device_->handle(), pool_, nullptr);
}

void Gui::begin(int width, int height) {
    ImGui_ImplVulkan_NewFrame();
    if (window_ != nullptr)
        ImGui_ImplGlfw_NewFrame();
    else
        ImGui::GetIO().DeltaTime = 1.0f / 60;
    use_pixels(width, height);
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

namespace {

double luminance(const ThemeColour& c) {
    const auto linear = [](float v) {
        return v <= 0.04045f ? v / 12.92 : std::pow((double{v} + 0.055) / 1.055, 2.4);
    };
    return 0.2126 * linear(c[0]) + 0.7152 * linear(c[1]) + 0.0722 * linear(c[2]);
}

ImVec4 imgui_colour(const ThemeColour& c) {
    return {c[0], c[1], c[2], c[3]};
}

struct ThemeRow {
    ImGuiCol colour;
    ThemeColour value;
};

constexpr ThemeRow kThemeRows[] = {
    {ImGuiCol_Text, theme::kText},
    {ImGuiCol_TextDisabled, theme::kTextOff},
    {ImGuiCol_WindowBg, theme::kWindow},
    {ImGuiCol_PopupBg, theme::kWindow},
    {ImGuiCol_TitleBg, theme::kField},
    {ImGuiCol_TitleBgActive, theme::kField},
    {ImGuiCol_TitleBgCollapsed, theme::kField},
    {ImGuiCol_Border, theme::kEdge},
    {ImGuiCol_Separator, theme::kEdge},
    {ImGuiCol_FrameBg, theme::kField},
    {ImGuiCol_FrameBgHovered, theme::kHovered},
    {ImGuiCol_FrameBgActive, theme::kActive},
    {ImGuiCol_Button, theme::kButton},
    {ImGuiCol_ButtonHovered, theme::kHovered},
    {ImGuiCol_ButtonActive, theme::kActive},
    {ImGuiCol_Header, theme::kButton},
    {ImGuiCol_HeaderHovered, theme::kHovered},
    {ImGuiCol_HeaderActive, theme::kActive},
    {ImGuiCol_CheckMark, theme::kAccent},
    {ImGuiCol_SliderGrab, theme::kGrab},
    {ImGuiCol_SliderGrabActive, theme::kGrab},
    {ImGuiCol_PlotLines, theme::kAccent},
    {ImGuiCol_PlotHistogram, theme::kGrab},
    {ImGuiCol_ScrollbarBg, theme::kWindow},
    {ImGuiCol_ScrollbarGrab, theme::kEdge},
    {ImGuiCol_TextSelectedBg, theme::kActive},
    {ImGuiCol_MenuBarBg, theme::kField},
    {ImGuiCol_Tab, theme::kField},
    {ImGuiCol_TabHovered, theme::kHovered},
    {ImGuiCol_TabActive, theme::kActive},
    {ImGuiCol_TabUnfocused, theme::kField},
    {ImGuiCol_TabUnfocusedActive, theme::kActive},
    {ImGuiCol_TableHeaderBg, theme::kField},
    {ImGuiCol_TableBorderStrong, theme::kEdge},
    {ImGuiCol_TableBorderLight, theme::kEdge},
};

}  // namespace

double contrast(const ThemeColour& a, const ThemeColour& b) {
    const double la = luminance(a), lb = luminance(b);
    return (std::max(la, lb) + 0.05) / (std::min(la, lb) + 0.05);
}

void apply_theme(float scale) {
    ImGuiStyle& style = ImGui::GetStyle();
    style = ImGuiStyle();
    ImGui::StyleColorsDark();
    for (const ThemeRow& row : kThemeRows) style.Colors[row.colour] = imgui_colour(row.value);
    style.WindowRounding = 6;
    style.FrameRounding = style.PopupRounding = style.GrabRounding = 4;
    style.WindowPadding = ImVec2(10, 10);
    style.FramePadding = ImVec2(7, 4);
    style.ItemSpacing = ImVec2(7, 6);
    style.ItemInnerSpacing = ImVec2(6, 4);
    style.ScrollbarSize = 12;
    style.WindowBorderSize = 1;
    style.FrameBorderSize = 1;  // else an empty box to tick is hardly seen on the ground
    style.ScaleAllSizes(scale);
}

}  // namespace darb
