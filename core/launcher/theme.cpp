#include "launcher/theme.hpp"

#include <imgui.h>

namespace calot::launcher {

void apply_theme(double scale) {
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    style.WindowRounding = 8;
    style.ChildRounding = 6;
    style.FrameRounding = 5;
    style.PopupRounding = 5;
    style.GrabRounding = 5;
    style.WindowPadding = ImVec2(20, 18);
    style.FramePadding = ImVec2(12, 8);
    style.ItemSpacing = ImVec2(12, 10);
    style.CellPadding = ImVec2(10, 6);
    style.ScrollbarSize = 16;
    style.WindowBorderSize = 1;
    style.ScaleAllSizes(static_cast<float>(scale));
    const auto set = [&style](ImGuiCol which, float r, float g, float b, float a) {
        style.Colors[which] = ImVec4(r, g, b, a);
    };
    set(ImGuiCol_Text, 0.90f, 0.92f, 0.94f, 1);
    set(ImGuiCol_TextDisabled, 0.58f, 0.64f, 0.68f, 1);
    set(ImGuiCol_WindowBg, 0.082f, 0.102f, 0.118f, 0.97f);
    set(ImGuiCol_ChildBg, 0.105f, 0.130f, 0.150f, 1);
    set(ImGuiCol_PopupBg, 0.105f, 0.130f, 0.150f, 0.98f);
    set(ImGuiCol_Border, 0.22f, 0.28f, 0.32f, 1);
    set(ImGuiCol_FrameBg, 0.145f, 0.180f, 0.205f, 1);
    set(ImGuiCol_FrameBgHovered, 0.185f, 0.230f, 0.260f, 1);
    set(ImGuiCol_FrameBgActive, 0.210f, 0.270f, 0.305f, 1);
    set(ImGuiCol_Button, 0.165f, 0.235f, 0.270f, 1);
    set(ImGuiCol_ButtonHovered, 0.205f, 0.310f, 0.355f, 1);
    set(ImGuiCol_ButtonActive, 0.120f, 0.400f, 0.440f, 1);
    set(ImGuiCol_Header, 0.120f, 0.330f, 0.370f, 0.75f);
    set(ImGuiCol_HeaderHovered, 0.150f, 0.360f, 0.400f, 0.75f);
    set(ImGuiCol_HeaderActive, 0.150f, 0.420f, 0.460f, 0.9f);
    set(ImGuiCol_TableHeaderBg, 0.130f, 0.165f, 0.190f, 1);
    set(ImGuiCol_TableBorderLight, 0.18f, 0.225f, 0.255f, 1);
    set(ImGuiCol_TableBorderStrong, 0.22f, 0.28f, 0.32f, 1);
    set(ImGuiCol_TableRowBgAlt, 1, 1, 1, 0.025f);
    set(ImGuiCol_CheckMark, 0.30f, 0.78f, 0.80f, 1);
    set(ImGuiCol_NavHighlight, 0.30f, 0.78f, 0.80f, 1);
    set(ImGuiCol_ScrollbarBg, 0, 0, 0, 0.15f);
    ImGui::GetStyle() = style;
}

} // namespace calot::launcher
