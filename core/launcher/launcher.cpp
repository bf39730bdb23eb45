#include "launcher/launcher.hpp"

#include "launcher/child.hpp"
#include "launcher/picture.hpp"
#include "launcher/results.hpp"
#include "launcher/theme.hpp"
#include "rendering/types.hpp"
#include "rendering/window.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <imgui.h>
#include <imgui_stdlib.h>
#include <optional>
#include <thread>

namespace calot::launcher {

struct Launcher::State {
    LauncherSettings settings;
    rendering::Window window;
    rendering::Overlay overlay;
    std::vector<Picture> pictures;
    LauncherPage page = LauncherPage::Choose;
    std::size_t procedure = 0, device = 0;
    int seed = 1;
    std::string operator_code;
    bool open = true;

    std::unique_ptr<Child> child;
    std::filesystem::path case_folder;
    std::vector<Result> results;
    std::string outcome, problem;

    explicit State(LauncherSettings s)
        : settings(std::move(s)), window("Calot", settings.width, settings.height),
          overlay(settings.text_scale) {
        window.connect(overlay);
        apply_theme(settings.text_scale);
        pictures.reserve(settings.procedures.size());
        for (const ProcedureEntry& p : settings.procedures)
            pictures.push_back(load_picture(p.picture));
        for (std::size_t i = 0; i < settings.devices.size(); ++i)
            if (settings.devices[i].id == settings.preferred_device) device = i;
    }
    ~State() {
        child.reset();
        window.disconnect();
    }

    void begin_case(const std::string& device_id, std::uint64_t case_seed);
    void end_case();
    void draw();
    void clear() const;
    void draw_choice();
    void draw_details(const ProcedureEntry&, const Picture&);
    void draw_running();
    void draw_results();
    void heading(const char* text) const {
        ImGui::PushFont(overlay.large());
        ImGui::TextUnformatted(text);
        ImGui::PopFont();
    }
    bool big_button(const char* label, float width) const {
        ImGui::PushStyleColor(ImGuiCol_Button, ImVec4(0.08f, 0.44f, 0.47f, 1));
        ImGui::PushStyleColor(ImGuiCol_ButtonHovered, ImVec4(0.10f, 0.53f, 0.56f, 1));
        ImGui::PushFont(overlay.large());
        const bool pressed = ImGui::Button(label, ImVec2(width, overlay.large()->FontSize * 2.0f));
        ImGui::PopFont();
        ImGui::PopStyleColor(2);
        return pressed;
    }
};

namespace {

std::string new_case_name(const std::string& id) {
    const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    std::tm local{};
    localtime_r(&now, &local);
    char text[64];
    std::strftime(text, sizeof text, "%Y-%m-%d_%H-%M-%S", &local);
    const auto dot = id.find_last_of('.');
    return std::string(text) + "_" + (dot == std::string::npos ? id : id.substr(dot + 1));
}

// Four significant digits are what a reader needs; the file has them all. What is not a number stays as it
// is.
std::string readable(const std::string& value) {
    double number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size() || value.find('.') == std::string::npos)
        return value;
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", number);
    return text;
}

std::string last_line(const std::string& text) {
    std::string out = text;
    while (!out.empty() && (out.back() == '\n' || out.back() == ' '))
        out.pop_back();
    const auto at = out.find_last_of('\n');
    return at == std::string::npos ? out : out.substr(at + 1);
}

// The documented exit codes of `calot run`.
std::string outcome_of(int code) {
    switch (code) {
    case 0:
        return "Completed";
    case 1:
        return "Not completed";
    case 2:
        return "The case could not start";
    case 3:
        return "The case was ended by a failure of a plugin or a device";
    default:
        return code > 128 ? "The case ended by signal " + std::to_string(code - 128)
                          : "The case ended with code " + std::to_string(code);
    }
}

} // namespace

void Launcher::State::begin_case(const std::string& device_id, std::uint64_t case_seed) {
    const ProcedureEntry& p = settings.procedures[procedure];
    problem.clear();
    results.clear();
    try {
        case_folder = settings.cases_folder / new_case_name(p.id);
        for (int i = 2; std::filesystem::exists(case_folder); ++i)
            case_folder = settings.cases_folder / (new_case_name(p.id) + "_" + std::to_string(i));
        std::filesystem::create_directories(case_folder);
        std::vector<std::string> words{settings.program.string(),
                                       "run",
                                       p.id,
                                       "--device",
                                       device_id,
                                       "--seed",
                                       std::to_string(case_seed),
                                       "--out",
                                       case_folder.string()};
        if (!operator_code.empty()) words.insert(words.end(), {"--operator", operator_code});
        child = std::make_unique<Child>(words);
        page = LauncherPage::Running;
    } catch (const std::exception& error) {
        problem = error.what();
    }
}

void Launcher::State::end_case() {
    const int code = child->exit_code();
    outcome = outcome_of(code);
    problem = code == 0 || code == 1 ? std::string() : last_line(child->words());
    child.reset();
    try {
        results = read_results(case_folder);
    } catch (const std::exception& error) {
        if (problem.empty()) problem = error.what();
    }
    page = LauncherPage::Results;
    window.set_visible(true);
}

void Launcher::State::draw_details(const ProcedureEntry& p, const Picture& picture) {
    heading(p.title.c_str());
    std::string line = p.specialty;
    for (const std::string& part :
         {p.level,
          p.minutes > 0 ? "about " + std::to_string(std::lround(p.minutes)) + " min" : std::string()})
        if (!part.empty()) line += (line.empty() ? "" : "   \xC2\xB7   ") + part;
    ImGui::TextDisabled("%s", line.c_str());
    if (!picture.empty()) {
        const float width = ImGui::GetContentRegionAvail().x;
        const float scale =
            std::min(width / static_cast<float>(picture.width),
                     ImGui::GetContentRegionAvail().y * 0.55f / static_cast<float>(picture.height));
        ImGui::Image(
            reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(*picture.texture)),
            ImVec2(static_cast<float>(picture.width) * scale, static_cast<float>(picture.height) * scale));
    }
    ImGui::PushTextWrapPos(0);
    ImGui::TextUnformatted(p.description.c_str());
    ImGui::PopTextWrapPos();
}

void Launcher::State::draw_choice() {
    const ImVec2 room = ImGui::GetContentRegionAvail();
    const float list_width = room.x * 0.36f;
    const float below = overlay.large()->FontSize * 2.0f +
                        static_cast<float>(overlay.line_height()) * (problem.empty() ? 2.6f : 4.0f);
    ImGui::BeginChild("procedures", ImVec2(list_width, room.y - below), true);
    heading("Procedures");
    if (settings.procedures.empty())
        ImGui::TextWrapped(
            "No procedure is installed. \"calot list\" and \"calot why ID\" say what was looked at.");
    for (std::size_t i = 0; i < settings.procedures.size(); ++i) {
        const ProcedureEntry& p = settings.procedures[i];
        ImGui::PushID(static_cast<int>(i));
        const float height = static_cast<float>(overlay.line_height()) * 2.5f;
        const ImVec2 at = ImGui::GetCursorScreenPos();
        if (ImGui::Selectable("##entry", i == procedure, 0, ImVec2(0, height))) procedure = i;
        ImDrawList* draw = ImGui::GetWindowDrawList();
        const float pad = overlay.body()->FontSize * 0.4f, right = at.x + list_width - 4 * pad;
        draw->PushClipRect(at, ImVec2(right, at.y + height), true);
        draw->AddText(overlay.body(), overlay.body()->FontSize, ImVec2(at.x + pad, at.y + pad),
                      ImGui::GetColorU32(ImGuiCol_Text), p.title.c_str());
        draw->AddText(overlay.body(), overlay.body()->FontSize * 0.85f,
                      ImVec2(at.x + pad, at.y + pad + overlay.body()->FontSize * 1.3f),
                      ImGui::GetColorU32(ImGuiCol_TextDisabled),
                      (p.specialty + (p.level.empty() ? "" : ", " + p.level)).c_str());
        draw->PopClipRect();
        ImGui::PopID();
    }
    ImGui::EndChild();
    ImGui::SameLine();
    ImGui::BeginChild("details", ImVec2(0, room.y - below), true);
    if (procedure < settings.procedures.size())
        draw_details(settings.procedures[procedure], pictures[procedure]);
    ImGui::EndChild();

    // Device, operator, seed, start.
    const float unit = overlay.body()->FontSize;
    const float top = ImGui::GetCursorPosY();
    if (ImGui::BeginTable("choices", 3, ImGuiTableFlags_SizingFixedFit, ImVec2(unit * 38, 0))) {
        for (const char* label : {"Device", "Operator", "Variation"}) {
            ImGui::TableNextColumn();
            ImGui::TextDisabled("%s", label);
        }
        ImGui::TableNextColumn();
        ImGui::SetNextItemWidth(unit * 16);
        const char* current =
            device < settings.devices.size() ? settings.devices[device].title.c_str() : "none installed";
        if (ImGui::BeginCombo("##device", current)) {
            for (std::size_t i = 0; i < settings.devices.size(); ++i)
                if (ImGui::Selectable((settings.devices[i].title + "##" + settings.devices[i].id).c_str(),
                                      i == device))
                    device = i;
            ImGui::EndCombo();
        }
        ImGui::TableNextColumn();
        ImGui::SetNextItemWidth(unit * 8);
        ImGui::InputTextWithHint("##operator", "code", &operator_code);
        if (operator_code.size() > 64) operator_code.resize(64);
        ImGui::TableNextColumn();
        ImGui::SetNextItemWidth(unit * 8);
        if (ImGui::InputInt("##seed", &seed)) seed = std::clamp(seed, 0, 1'000'000'000);
        ImGui::EndTable();
    }
    const float bottom = ImGui::GetCursorPosY();

    const bool ready = procedure < settings.procedures.size() && device < settings.devices.size();
    const float start_width = unit * 10, show_width = unit * 12;
    const bool has_demonstration =
        procedure < settings.procedures.size() && !settings.procedures[procedure].demonstration.empty();
    ImGui::SetCursorPos(ImVec2(ImGui::GetWindowContentRegionMax().x - start_width -
                                   (has_demonstration ? show_width + unit : 0),
                               top + unit * 0.6f));
    ImGui::BeginGroup();
    if (has_demonstration) {
        if (ImGui::Button("Watch a demonstration", ImVec2(show_width, overlay.large()->FontSize * 2.0f)))
            begin_case(settings.procedures[procedure].demonstration,
                       settings.procedures[procedure].demonstration_seed);
        ImGui::SameLine();
    }
    ImGui::BeginDisabled(!ready);
    if (big_button("Start", start_width))
        begin_case(settings.devices[device].id, static_cast<std::uint64_t>(seed));
    ImGui::EndDisabled();
    ImGui::EndGroup();
    ImGui::SetCursorPosY(std::max(bottom, ImGui::GetCursorPosY()));
    if (!problem.empty()) ImGui::TextColored(ImVec4(1, 0.62f, 0.5f, 1), "%s", problem.c_str());
    if (!settings.refusals.empty()) {
        ImGui::TextDisabled("%zu plugin%s refused: %s", settings.refusals.size(),
                            settings.refusals.size() == 1 ? " was" : "s were",
                            settings.refusals.front().c_str());
        if (ImGui::IsItemHovered()) {
            ImGui::BeginTooltip();
            for (const std::string& line : settings.refusals)
                ImGui::TextUnformatted(line.c_str());
            ImGui::EndTooltip();
        }
    }
}

void Launcher::State::draw_running() {
    heading("A case is being performed");
    ImGui::TextDisabled("It has a window of its own. Its record is kept in");
    ImGui::TextUnformatted(case_folder.c_str());
    ImGui::Spacing();
    if (ImGui::Button("End the case")) child->ask_to_end();
}

void Launcher::State::draw_results() {
    const ProcedureEntry& p = settings.procedures[procedure];
    heading(p.title.c_str());
    ImGui::TextColored(outcome == "Completed" ? ImVec4(0.45f, 0.85f, 0.6f, 1)
                                              : ImVec4(0.95f, 0.78f, 0.45f, 1),
                       "%s", outcome.c_str());
    if (!problem.empty()) ImGui::TextWrapped("%s", problem.c_str());
    const float unit = overlay.body()->FontSize;
    const float below = unit * 6;
    if (!results.empty() &&
        ImGui::BeginTable("metrics", 4,
                          ImGuiTableFlags_RowBg | ImGuiTableFlags_BordersInnerH | ImGuiTableFlags_ScrollY,
                          ImVec2(0, ImGui::GetContentRegionAvail().y - below))) {
        ImGui::TableSetupColumn("Task", ImGuiTableColumnFlags_WidthFixed, unit * 7);
        ImGui::TableSetupColumn("Metric", ImGuiTableColumnFlags_WidthStretch);
        ImGui::TableSetupColumn("Value", ImGuiTableColumnFlags_WidthFixed, unit * 9);
        ImGui::TableSetupColumn("Unit", ImGuiTableColumnFlags_WidthFixed, unit * 5);
        ImGui::TableSetupScrollFreeze(0, 1);
        ImGui::TableHeadersRow();
        for (const Result& r : results) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::TextDisabled("%s", r.task.c_str());
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(r.title.c_str());
            if (!r.definition.empty() && ImGui::IsItemHovered()) {
                ImGui::BeginTooltip();
                ImGui::PushTextWrapPos(unit * 28);
                ImGui::TextUnformatted(r.definition.c_str());
                ImGui::PopTextWrapPos();
                ImGui::EndTooltip();
            }
            ImGui::TableNextColumn();
            if (r.value.empty())
                ImGui::TextDisabled("not measured");
            else
                ImGui::TextUnformatted(readable(r.value).c_str());
            ImGui::TableNextColumn();
            ImGui::TextDisabled("%s", r.unit.c_str());
        }
        ImGui::EndTable();
    }
    ImGui::TextDisabled("Files: %s", case_folder.c_str());
    if (big_button("Back", unit * 10)) {
        page = LauncherPage::Choose;
        problem.clear();
    }
}

void Launcher::State::draw() {
    const ImGuiIO& io = ImGui::GetIO();
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(io.DisplaySize);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    ImGui::PushFont(overlay.body());
    ImGui::Begin("calot", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
    heading("Calot");
    ImGui::SameLine();
    ImGui::TextDisabled("  flexible endoscopy, simulated");
    ImGui::Separator();
    switch (page) {
    case LauncherPage::Choose:
        draw_choice();
        break;
    case LauncherPage::Running:
        draw_running();
        break;
    case LauncherPage::Results:
        draw_results();
        break;
    }
    ImGui::End();
    ImGui::PopFont();
    ImGui::PopStyleVar(2);
}

void Launcher::State::clear() const {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, window.width(), window.height());
    glClearColor(0.06f, 0.075f, 0.09f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
}

Launcher::Launcher(LauncherSettings settings) : state_(std::make_unique<State>(std::move(settings))) {}
Launcher::~Launcher() = default;

LauncherPage Launcher::page() const {
    return state_->page;
}

void Launcher::start() {
    State& s = *state_;
    if (s.page == LauncherPage::Choose && s.procedure < s.settings.procedures.size() &&
        s.device < s.settings.devices.size())
        s.begin_case(s.settings.devices[s.device].id, static_cast<std::uint64_t>(s.seed));
}

bool Launcher::step() {
    State& s = *state_;
    s.window.poll(&s.overlay, [&s](const rendering::WindowEvent& e) {
        if (e.kind == rendering::WindowEvent::Kind::Close) s.open = false;
    });
    if (!s.open) return false;
    if (s.child && !s.child->poll()) s.end_case();
    s.overlay.begin(s.window.width(), s.window.height(), 1.0 / 60, s.window.new_frame());
    s.draw();
    s.clear();
    s.overlay.end();
    s.window.swap();
    // Nothing moves here: leave the processor to the case.
    std::this_thread::sleep_for(std::chrono::milliseconds(s.page == LauncherPage::Running ? 200 : 15));
    return true;
}

void Launcher::read(rendering::Image& out) {
    State& s = *state_;
    s.clear(); // what was swapped is the window system's: draw it again
    s.overlay.repeat();
    out.width = s.window.width();
    out.height = s.window.height();
    const std::size_t row = static_cast<std::size_t>(out.width) * 4;
    out.rgba.resize(row * static_cast<std::size_t>(out.height));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
    glReadPixels(0, 0, out.width, out.height, GL_RGBA, GL_UNSIGNED_BYTE, out.rgba.data());
    for (int y = 0; y < out.height / 2; ++y)
        std::swap_ranges(out.rgba.begin() + static_cast<std::ptrdiff_t>(row) * y,
                         out.rgba.begin() + static_cast<std::ptrdiff_t>(row) * (y + 1),
                         out.rgba.begin() + static_cast<std::ptrdiff_t>(row) * (out.height - 1 - y));
    for (std::size_t i = 3; i < out.rgba.size(); i += 4)
        out.rgba[i] = 255;
}

} // namespace calot::launcher
