#include "launcher/case_window.hpp"

#include "launcher/theme.hpp"
#include "rendering/gl_objects.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <imgui.h>

namespace calot::launcher {
namespace {

using rendering::WindowEvent;

constexpr double kTurnPerPixel = 0.006; // rad
constexpr double kZoomPerNotch = 0.88;

rendering::RendererSettings sized(rendering::RendererSettings s, const rendering::Window& window) {
    s.width = std::clamp(window.width(), 64, 8192);
    s.height = std::clamp(window.height(), 64, 8192);
    if (rendering::draws_on_processor()) s.samples = 1; // 4 triple the time there
    return s;
}

// Without a minus before what rounds to nothing.
double shown(double value, int digits) {
    const double unit = std::pow(10.0, digits);
    return std::round(value * unit) / unit + 0.0;
}

bool centred_panel(const char* name, float width) {
    const ImGuiIO& io = ImGui::GetIO();
    ImGui::SetNextWindowPos(ImVec2(io.DisplaySize.x / 2, io.DisplaySize.y / 2), ImGuiCond_Always,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(std::min(width, io.DisplaySize.x - 20), 0),
                                        ImVec2(io.DisplaySize.x - 20, io.DisplaySize.y - 20));
    return ImGui::Begin(name, nullptr,
                        ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                            ImGuiWindowFlags_AlwaysAutoResize);
}

void help_rows(const std::vector<HelpLine>& lines) {
    for (const HelpLine& line : lines) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        ImGui::TextColored(ImVec4(0.55f, 0.85f, 0.88f, 1), "%s", line.input.c_str());
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(line.effect.c_str());
    }
}

} // namespace

std::vector<std::string> status_lines(const CaseStatus& s) {
    const auto whole = static_cast<long>(std::max(0.0, s.seconds));
    char text[256];
    std::snprintf(text, sizeof text, "%02ld:%02ld   push %.1f N   turn %.2f N m   tissue %.1f N", whole / 60,
                  whole % 60, shown(s.push_force, 1), shown(s.turn_torque, 2), shown(s.tissue_force, 1));
    std::string second = text;
    if (s.slipped_ticks > 0) {
        std::snprintf(text, sizeof text, "   SLOWER THAN REAL TIME by %.1f s",
                      static_cast<double>(s.slipped_ticks) * 1e-3);
        second += text;
    } else if (s.late_ticks > 0) {
        std::snprintf(text, sizeof text, "   %ld late", s.late_ticks);
        second += text;
    }
    const std::string first = s.message.empty() ? s.task
                              : s.task.empty()  ? s.message
                                                : s.task + " \xE2\x80\x93 " + s.message;
    return {first, second};
}

CaseWindow::CaseWindow(const CaseWindowSettings& settings,
                       std::function<void(const calot_input_event&)> input)
    : settings_(settings), input_(std::move(input)), window_(settings.title, settings.width, settings.height),
      renderer_(sized(settings.renderer, window_)) {
    window_.connect(renderer_.overlay());
    apply_theme(settings.renderer.text_scale);
}

CaseWindow::~CaseWindow() {
    window_.disconnect();
}

void CaseWindow::frame_external_view(const rendering::Vec3& centre, double radius) {
    camera_.frame(centre, radius, rendering::ExternalCamera{}.vertical_field);
}

void CaseWindow::let_go() {
    calot_input_event e{};
    e.struct_size = sizeof(e);
    e.kind = CALOT_EVENT_FOCUS;
    if (input_) input_(e);
}

void CaseWindow::handle(const WindowEvent& e, const CaseStatus& status) {
    const rendering::Layout layout = renderer_.layout(external_on_);
    switch (e.kind) {
    case WindowEvent::Kind::Close:
        request_ = CaseRequest::Finish;
        break;
    case WindowEvent::Kind::Resized:
        break; // the size is read anew for each frame
    case WindowEvent::Kind::KeyDown:
        if (e.repeated) break;
        if (e.key == rendering::kKeyF1) {
            show_help_ = !show_help_;
            if (show_help_) let_go();
        } else if (e.key == rendering::kKeyF2) {
            external_on_ = !external_on_;
        } else if (e.key == rendering::kKeyF3) {
            walls_ = (walls_ + 1) % 3;
        } else if (e.key == rendering::kKeyF11) {
            window_.set_fullscreen(!window_.is_fullscreen());
        } else if (e.key == rendering::kKeyEscape) {
            if (show_help_) {
                show_help_ = false;
            } else {
                request_ = status.is_paused ? CaseRequest::Resume : CaseRequest::Pause;
                let_go();
            }
        }
        break;
    case WindowEvent::Kind::MouseDown:
        if (panel_open(status) || !external_on_ || !layout.external.contains(e.x, e.y)) break;
        dragging_ = dragging_ || e.button == 1;
        shifting_ = shifting_ || e.button == 2;
        break;
    case WindowEvent::Kind::MouseUp:
        if (e.button == 1) dragging_ = false;
        if (e.button == 2) shifting_ = false;
        break;
    case WindowEvent::Kind::MouseMove:
        if (dragging_) camera_.turn(-e.dx * kTurnPerPixel, e.dy * kTurnPerPixel);
        if (shifting_) {
            const double metres = 2 * camera_.distance() *
                                  std::tan(rendering::ExternalCamera{}.vertical_field / 2) /
                                  std::max(layout.external.height, 1);
            camera_.shift(e.dx * metres, e.dy * metres);
        }
        break;
    case WindowEvent::Kind::Wheel:
        if (external_on_ && layout.external.contains(e.x, e.y)) camera_.zoom(std::pow(kZoomPerNotch, e.dy));
        break;
    case WindowEvent::Kind::Input:
        if (input_ && !panel_open(status)) input_(e.input);
        break;
    }
}

void CaseWindow::draw_panels(rendering::Overlay& overlay, const CaseStatus& status) {
    const ImGuiIO& io = ImGui::GetIO();
    ImDrawList* behind = ImGui::GetBackgroundDrawList();
    const float line = static_cast<float>(overlay.line_height());
    const char* keys = "F1 help    F2 external view    F3 walls    Esc pause    F11 full screen";
    const ImVec2 at(io.DisplaySize.x / 80, io.DisplaySize.y - line);
    behind->AddText(overlay.body(), overlay.body()->FontSize * 0.85f, ImVec2(at.x + 1.5f, at.y + 1.5f),
                    IM_COL32(0, 0, 0, 230), keys);
    behind->AddText(overlay.body(), overlay.body()->FontSize * 0.85f, at, IM_COL32(190, 202, 212, 240), keys);
    ImGui::PushFont(overlay.body());
    if (status.is_paused && !show_help_) {
        if (centred_panel("pause", 420)) {
            ImGui::PushFont(overlay.large());
            ImGui::TextUnformatted("Paused");
            ImGui::PopFont();
            ImGui::TextDisabled("The clock stands still; nothing is measured.");
            ImGui::Spacing();
            const ImVec2 wide(ImGui::GetContentRegionAvail().x, line * 1.9f);
            if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
            if (ImGui::Button("Resume  (Esc)", wide)) request_ = CaseRequest::Resume;
            if (ImGui::Button("Help  (F1)", wide)) show_help_ = true;
            if (ImGui::Button("Finish and see the metrics", wide)) request_ = CaseRequest::Finish;
        }
        ImGui::End();
    }
    if (show_help_) {
        if (centred_panel("help", 940)) {
            ImGui::PushFont(overlay.large());
            ImGui::TextUnformatted("Help");
            ImGui::PopFont();
            if (ImGui::BeginTable(
                    "keys", 2,
                    ImGuiTableFlags_RowBg | ImGuiTableFlags_BordersInnerH | ImGuiTableFlags_ScrollY,
                    ImVec2(900,
                           std::min(io.DisplaySize.y - 200,
                                    line * 1.45f * static_cast<float>(settings_.device_help.size() + 7))))) {
                ImGui::TableSetupColumn("input", ImGuiTableColumnFlags_WidthFixed, 300);
                ImGui::TableSetupColumn("effect", ImGuiTableColumnFlags_WidthStretch);
                help_rows(settings_.device_help);
                help_rows({{"F1 or Esc", "close this help"},
                           {"F2", "external view on / off"},
                           {"F3", "organs' walls: see-through, solid, cut open"},
                           {"Left mouse button in the external view",
                            "turn the view; the wheel zooms, the middle button shifts"},
                           {"F11", "full screen"},
                           {"Esc", "pause, finish"}});
                ImGui::EndTable();
            }
            if (ImGui::Button("Close", ImVec2(160, 0))) show_help_ = false;
        }
        ImGui::End();
    }
    ImGui::PopFont();
}

CaseRequest CaseWindow::show(rendering::FrameState frame, const CaseStatus& status) {
    request_ = CaseRequest::None;
    window_.poll(&renderer_.overlay(), [&](const WindowEvent& e) { handle(e, status); });
    renderer_.resize(std::clamp(window_.width(), 64, 8192), std::clamp(window_.height(), 64, 8192));
    frame.external.on = external_on_;
    frame.external.pose = camera_.pose();
    frame.endoscope_text = status_lines(status);
    for (rendering::SurfaceState& s : frame.surfaces)
        if (walls_ > 0 && s.style == rendering::Style::Translucent)
            s.style = walls_ == 1 ? rendering::Style::Solid : rendering::Style::Cut;
    if (walls_ == 2 && !frame.cut) frame.cut = rendering::CutPlane{camera_.target(), {0, -1, 0}};
    renderer_.draw(
        frame, [&](rendering::Overlay& overlay) { draw_panels(overlay, status); }, window_.new_frame());
    renderer_.present();
    window_.swap();
    return request_;
}

} // namespace calot::launcher
