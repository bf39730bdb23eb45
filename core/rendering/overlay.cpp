#include "rendering/overlay.hpp"

#include <algorithm>
#include <backends/imgui_impl_opengl3.h>
#include <filesystem>
#include <imgui.h>
#include <stdexcept>
#include <system_error>

namespace calot::rendering {
namespace {

// DejaVu (package fonts-dejavu-core) where it is installed, else ImGui's own bitmap font, enlarged.
ImFont* load_font(ImGuiIO& io, float pixels) {
    constexpr const char* kFile = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
    static constexpr ImWchar kRanges[] = {0x20, 0xFF, 0x2010, 0x2030, 0x2190, 0x21FF, 0x370, 0x3FF, 0};
    std::error_code error;
    if (std::filesystem::exists(kFile, error))
        if (ImFont* font = io.Fonts->AddFontFromFileTTF(kFile, pixels, nullptr, kRanges)) return font;
    ImFontConfig config;
    config.SizePixels = pixels;
    return io.Fonts->AddFontDefault(&config);
}

} // namespace

Overlay::Overlay(double scale) {
    IMGUI_CHECKVERSION();
    context_ = ImGui::CreateContext();
    ImGui::SetCurrentContext(context_);
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    body_ = load_font(io, static_cast<float>(18 * scale));
    large_ = load_font(io, static_cast<float>(26 * scale));
    if (!ImGui_ImplOpenGL3_Init("#version 330 core")) {
        ImGui::DestroyContext(context_);
        throw std::runtime_error("the overlay cannot use this OpenGL context (is libgl1 installed?)");
    }
}

Overlay::~Overlay() {
    ImGui::SetCurrentContext(context_);
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext(context_);
}

void Overlay::begin(int width, int height, double seconds, const std::function<void()>& platform) {
    ImGui::SetCurrentContext(context_);
    ImGui_ImplOpenGL3_NewFrame();
    if (platform) {
        platform();
    } else {
        ImGuiIO& io = ImGui::GetIO();
        io.DisplaySize = ImVec2(static_cast<float>(width), static_cast<float>(height));
        io.DeltaTime = static_cast<float>(std::clamp(seconds, 1e-4, 1.0));
    }
    ImGui::NewFrame();
}

void Overlay::end() {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Overlay::repeat() {
    ImGui::SetCurrentContext(context_);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

double Overlay::line_height() const {
    return body_->FontSize * 1.35;
}

void Overlay::text_lines(double x, double y, double width, double size,
                         const std::vector<std::string>& lines) {
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    bool first = true;
    for (const std::string& line : lines) {
        ImFont* font = first ? large_ : body_;
        const auto wrap = static_cast<float>(std::max(width, 40.0));
        float pixels = std::max(9.0f, font->FontSize * static_cast<float>(size));
        // A long line is set smaller before it is broken.
        const float whole = font->CalcTextSizeA(pixels, 1e6f, 0, line.data(), line.data() + line.size()).x;
        if (whole > wrap) pixels *= std::max(wrap / whole * 0.99f, 0.62f);
        const ImVec2 at(static_cast<float>(x), static_cast<float>(y));
        const char* end = line.data() + line.size();
        list->AddText(font, pixels, ImVec2(at.x + 1.5f, at.y + 1.5f), IM_COL32(0, 0, 0, 200), line.data(),
                      end, wrap);
        list->AddText(font, pixels, at, first ? IM_COL32(236, 240, 244, 255) : IM_COL32(186, 198, 208, 255),
                      line.data(), end, wrap);
        y += font->CalcTextSizeA(pixels, 1e6f, wrap, line.data(), end).y + pixels * 0.3f;
        first = false;
    }
}

} // namespace calot::rendering
