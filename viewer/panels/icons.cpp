// SPDX-License-Identifier: MIT
#include "viewer/panels/icons.h"

#include <array>
#include <cmath>
#include <initializer_list>
#include <vector>

namespace darb {

namespace {

constexpr float kPi = 3.14159265f;

// Draws in units of half the side, from -1 to 1, y down.
class Pen {
  public:
    Pen(ImDrawList& list, const ImVec2& centre, float side, ImU32 colour)
        : list_(list), centre_(centre), unit_(side / 2), colour_(colour) {}

    void lines(std::initializer_list<ImVec2> points, bool closed = false) {
        std::vector<ImVec2> px;
        for (const ImVec2& p : points) px.push_back(at(p));
        list_.AddPolyline(px.data(), static_cast<int>(px.size()), colour_,
                          closed ? ImDrawFlags_Closed : ImDrawFlags_None, width());
    }
    /// Dear ImGui smooths the edges of a triangle on their outside only if it turns clockwise.
    void fill(const ImVec2& a, const ImVec2& b, const ImVec2& c) {
        const float turn = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        list_.AddTriangleFilled(at(a), at(turn > 0 ? b : c), at(turn > 0 ? c : b), colour_);
    }
    void dot(const ImVec2& p, float radius) {
        list_.AddCircleFilled(at(p), radius * unit_, colour_);
    }
    void circle(const ImVec2& p, float radius) {
        list_.AddCircle(at(p), radius * unit_, colour_, 0, width());
    }
    void arc(const ImVec2& p, float radius, float from_degrees, float to_degrees) {
        list_.PathArcTo(at(p), radius * unit_, from_degrees * kPi / 180, to_degrees * kPi / 180);
        list_.PathStroke(colour_, ImDrawFlags_None, width());
    }
    void ellipse(float across, float along) {
        std::array<ImVec2, 32> px;
        for (std::size_t i = 0; i < px.size(); ++i) {
            const float a = 2 * kPi * static_cast<float>(i) / static_cast<float>(px.size());
            px[i] = at({across * std::cos(a), along * std::sin(a)});
        }
        list_.AddPolyline(px.data(), static_cast<int>(px.size()), colour_, ImDrawFlags_Closed,
                          width());
    }
    /// A line with a head at its end.
    void arrow(const ImVec2& from, const ImVec2& to) {
        const float dx = to.x - from.x, dy = to.y - from.y, l = std::hypot(dx, dy);
        const float ux = dx / l, uy = dy / l;
        constexpr float kTip = 0.36f, kHalf = 0.22f;
        const ImVec2 foot(to.x - kTip * ux, to.y - kTip * uy);
        lines({from, foot});
        fill(to, {foot.x - kHalf * uy, foot.y + kHalf * ux},
             {foot.x + kHalf * uy, foot.y - kHalf * ux});
    }

  private:
    ImVec2 at(const ImVec2& p) const { return {centre_.x + unit_ * p.x, centre_.y + unit_ * p.y}; }
    float width() const { return unit_ * 0.16f; }
    ImDrawList& list_;
    ImVec2 centre_;
    float unit_;
    ImU32 colour_;
};

void draw_tool(Pen& pen, Icon icon) {
    switch (icon) {
        case Icon::orbit:
            pen.dot({0, 0}, 0.22f);
            pen.ellipse(0.9f, 0.38f);
            pen.fill({0.05f, 0.38f}, {-0.3f, 0.14f}, {-0.3f, 0.62f});
            break;
        case Icon::rectangle:
            for (const float x : {-0.8f, 0.8f})
                for (const float y : {-0.65f, 0.65f})
                    pen.lines({{x * 0.35f, y}, {x, y}, {x, y * 0.35f}});
            break;
        case Icon::lasso:
            pen.lines({{-0.15f, 0.35f},
                       {-0.7f, 0.2f},
                       {-0.85f, -0.3f},
                       {-0.35f, -0.75f},
                       {0.4f, -0.75f},
                       {0.85f, -0.3f},
                       {0.6f, 0.2f},
                       {-0.15f, 0.35f},
                       {-0.35f, 0.65f},
                       {-0.1f, 0.9f}});
            break;
        case Icon::polygon: {
            const std::initializer_list<ImVec2> corners{
                {-0.75f, -0.2f}, {0.1f, -0.8f}, {0.8f, -0.15f}, {0.45f, 0.75f}, {-0.5f, 0.7f}};
            pen.lines(corners, true);
            for (const ImVec2& p : corners) pen.dot(p, 0.2f);
            break;
        }
        case Icon::flood:
            pen.lines({{-0.85f, 0.1f}, {-0.1f, -0.75f}, {0.6f, 0.0f}, {-0.15f, 0.8f}}, true);
            pen.lines({{-0.1f, -0.75f}, {-0.45f, -0.95f}});
            pen.fill({-0.85f, 0.1f}, {0.6f, 0.0f}, {-0.15f, 0.8f});
            pen.dot({0.78f, 0.6f}, 0.2f);
            pen.fill({0.78f, 0.15f}, {0.97f, 0.55f}, {0.59f, 0.55f});
            break;
        case Icon::brush:
            pen.lines({{0.85f, -0.85f}, {-0.05f, 0.05f}});
            pen.lines({{0.6f, -0.9f}, {0.9f, -0.6f}, {0.15f, 0.2f}, {-0.2f, -0.15f}}, true);
            pen.dot({-0.45f, 0.45f}, 0.32f);
            pen.fill({-0.95f, 0.9f}, {-0.6f, 0.2f}, {-0.2f, 0.65f});
            break;
        case Icon::sphere:
            pen.circle({0, 0}, 0.85f);
            pen.ellipse(0.85f, 0.3f);
            break;
        case Icon::move:
            for (const auto& [x, y] :
                 {std::pair{1.0f, 0.0f}, {-1.0f, 0.0f}, {0.0f, 1.0f}, {0.0f, -1.0f}})
                pen.arrow({0, 0}, {0.95f * x, 0.95f * y});
            break;
        case Icon::turn:
            pen.arc({0, 0}, 0.7f, -40, 250);
            pen.fill({0.15f, -0.85f}, {-0.3f, -1.0f}, {-0.3f, -0.4f});
            break;
        case Icon::scale:
            pen.lines({{-0.85f, 0.05f}, {-0.85f, 0.85f}, {-0.05f, 0.85f}, {-0.05f, 0.05f}}, true);
            pen.arrow({0.05f, -0.05f}, {0.9f, -0.9f});
            break;
        default:
            break;
    }
}

void draw_other(Pen& pen, Icon icon) {
    switch (icon) {
        case Icon::measure:
            pen.lines({{-0.95f, 0.45f}, {0.45f, -0.95f}, {0.95f, -0.45f}, {-0.45f, 0.95f}}, true);
            for (const float t : {-0.5f, 0.0f, 0.5f})
                pen.lines({{-0.25f + t, -0.25f - t}, {-0.02f + t, -0.02f - t}});
            break;
        case Icon::compare:
            pen.lines({{-0.9f, -0.7f}, {0.9f, -0.7f}, {0.9f, 0.7f}, {-0.9f, 0.7f}}, true);
            pen.lines({{0, -0.95f}, {0, 0.95f}});
            pen.fill({-0.75f, 0.55f}, {-0.45f, -0.1f}, {-0.15f, 0.55f});
            break;
        case Icon::cameras:
            pen.lines({{-0.9f, -0.4f}, {0.35f, -0.4f}, {0.35f, 0.6f}, {-0.9f, 0.6f}}, true);
            pen.fill({0.35f, 0.1f}, {0.95f, -0.4f}, {0.95f, 0.6f});
            break;
        case Icon::grid:
            pen.lines({{-0.5f, -0.6f}, {0.5f, -0.6f}, {0.95f, 0.7f}, {-0.95f, 0.7f}}, true);
            pen.lines({{0, -0.6f}, {0, 0.7f}});
            pen.lines({{-0.7f, 0}, {0.7f, 0}});
            break;
        case Icon::play:
            pen.fill({-0.6f, -0.85f}, {0.85f, 0}, {-0.6f, 0.85f});
            break;
        case Icon::undo:
        case Icon::redo: {
            const float to = icon == Icon::undo ? -1.0f : 1.0f;
            pen.fill({0.95f * to, -0.3f}, {0.35f * to, -0.75f}, {0.35f * to, 0.15f});
            pen.lines({{0.4f * to, -0.3f}, {-0.3f * to, -0.3f}});
            pen.arc({-0.3f * to, 0.15f}, 0.45f, to < 0 ? -90.0f : 90.0f, to < 0 ? 90.0f : 270.0f);
            pen.lines({{-0.3f * to, 0.6f}, {0.4f * to, 0.6f}});
            break;
        }
        default:
            break;
    }
}

}  // namespace

void draw_icon(ImDrawList& list, Icon icon, const ImVec2& centre, float side, ImU32 colour) {
    Pen pen(list, centre, side, colour);
    draw_tool(pen, icon);
    draw_other(pen, icon);
}

}  // namespace darb
