#include "rendering/window.hpp"

#include <SDL2/SDL.h>

#include <algorithm>
#include <backends/imgui_impl_sdl.h>
#include <imgui.h>
#include <stdexcept>
#include <vector>

namespace calot::rendering {

struct Window::State {
    SDL_Window* window = nullptr;
    SDL_GLContext context = nullptr;
    std::vector<SDL_GameController*> pads;
    Overlay* connected = nullptr;

    ~State() {
        for (SDL_GameController* pad : pads)
            SDL_GameControllerClose(pad);
        if (context) SDL_GL_DeleteContext(context);
        if (window) SDL_DestroyWindow(window);
        SDL_QuitSubSystem(SDL_INIT_VIDEO | SDL_INIT_GAMECONTROLLER);
    }
};

namespace {

calot_input_event input(std::uint32_t kind, std::uint32_t code, double value, double x = 0, double y = 0) {
    calot_input_event e{};
    e.struct_size = sizeof(e);
    e.kind = kind;
    e.code = code;
    e.value = value;
    e.x = x;
    e.y = y;
    return e;
}

// SDL counts left, middle, right as 1, 2, 3, as the contract does.
static_assert(SDL_BUTTON_LEFT == 1 && SDL_BUTTON_MIDDLE == 2 && SDL_BUTTON_RIGHT == 3);
static_assert(static_cast<int>(kKeyReturn) == SDL_SCANCODE_RETURN &&
              static_cast<int>(kKeyEscape) == SDL_SCANCODE_ESCAPE &&
              static_cast<int>(kKeyF1) == SDL_SCANCODE_F1 && static_cast<int>(kKeyF2) == SDL_SCANCODE_F2 &&
              static_cast<int>(kKeyF3) == SDL_SCANCODE_F3 && static_cast<int>(kKeyF11) == SDL_SCANCODE_F11);

} // namespace

Window::Window(const std::string& title, int width, int height) : state_(std::make_unique<State>()) {
    SDL_SetHint(SDL_HINT_VIDEO_X11_FORCE_EGL, "1");
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1"); // Ctrl-C belongs to the program
    if (SDL_InitSubSystem(SDL_INIT_VIDEO | SDL_INIT_GAMECONTROLLER) != 0)
        throw std::runtime_error(std::string("no window: ") + SDL_GetError() +
                                 "; without a display use --headless");
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_CORE);
    SDL_GL_SetAttribute(SDL_GL_DOUBLEBUFFER, 1);
    SDL_GL_SetAttribute(SDL_GL_DEPTH_SIZE, 0); // the renderer draws into its own framebuffer
    state_->window =
        SDL_CreateWindow(title.c_str(), SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, width, height,
                         SDL_WINDOW_OPENGL | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
    if (state_->window) state_->context = SDL_GL_CreateContext(state_->window);
    if (!state_->context)
        throw std::runtime_error(std::string("no window with OpenGL 3.3 core: ") + SDL_GetError());
    SDL_SetWindowMinimumSize(state_->window, 640, 400);
    SDL_GL_SetSwapInterval(1);
}

Window::~Window() = default;

void Window::connect(Overlay& overlay) {
    ImGui::SetCurrentContext(overlay.context());
    if (ImGui_ImplSDL2_InitForOpenGL(state_->window, state_->context)) state_->connected = &overlay;
    ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
}

void Window::disconnect() {
    if (!state_->connected) return;
    ImGui::SetCurrentContext(state_->connected->context());
    ImGui_ImplSDL2_Shutdown();
    state_->connected = nullptr;
}

std::function<void()> Window::new_frame() {
    return [] { ImGui_ImplSDL2_NewFrame(); };
}

void Window::poll(Overlay* overlay, const std::function<void(const WindowEvent&)>& event) {
    if (overlay) ImGui::SetCurrentContext(overlay->context());
    // Positions arrive in the window's units, which a scaled display makes larger than pixels.
    int units = 1;
    SDL_GetWindowSize(state_->window, &units, nullptr);
    const double scale = static_cast<double>(width()) / std::max(units, 1);
    const auto px = [scale](int v) { return static_cast<int>(v * scale); };
    const auto tell = [&event](calot_input_event e) {
        WindowEvent w;
        w.input = e;
        event(w);
    };
    SDL_Event e;
    while (SDL_PollEvent(&e)) {
        if (overlay && state_->connected) ImGui_ImplSDL2_ProcessEvent(&e);
        WindowEvent w;
        switch (e.type) {
        case SDL_QUIT:
            w.kind = WindowEvent::Kind::Close;
            event(w);
            break;
        case SDL_WINDOWEVENT:
            if (e.window.event == SDL_WINDOWEVENT_SIZE_CHANGED) {
                w.kind = WindowEvent::Kind::Resized;
                event(w);
            } else if (e.window.event == SDL_WINDOWEVENT_FOCUS_LOST ||
                       e.window.event == SDL_WINDOWEVENT_FOCUS_GAINED) {
                tell(input(CALOT_EVENT_FOCUS, 0, e.window.event == SDL_WINDOWEVENT_FOCUS_GAINED ? 1 : 0));
            }
            break;
        case SDL_KEYDOWN:
            w.kind = WindowEvent::Kind::KeyDown;
            w.key = e.key.keysym.scancode;
            w.repeated = e.key.repeat != 0;
            event(w);
            if (e.key.repeat == 0) tell(input(CALOT_EVENT_KEY, e.key.keysym.scancode, 1));
            break;
        case SDL_KEYUP:
            tell(input(CALOT_EVENT_KEY, e.key.keysym.scancode, 0));
            break;
        case SDL_MOUSEMOTION:
            w.kind = WindowEvent::Kind::MouseMove;
            w.x = px(e.motion.x);
            w.y = px(e.motion.y);
            w.dx = e.motion.xrel * scale;
            w.dy = e.motion.yrel * scale;
            event(w);
            tell(input(CALOT_EVENT_MOUSE_MOVE, 0, 0, w.dx, w.dy));
            break;
        case SDL_MOUSEBUTTONDOWN:
        case SDL_MOUSEBUTTONUP:
            w.kind =
                e.type == SDL_MOUSEBUTTONDOWN ? WindowEvent::Kind::MouseDown : WindowEvent::Kind::MouseUp;
            w.button = e.button.button;
            w.x = px(e.button.x);
            w.y = px(e.button.y);
            event(w);
            tell(input(CALOT_EVENT_MOUSE_BUTTON, e.button.button, e.type == SDL_MOUSEBUTTONDOWN ? 1 : 0));
            break;
        case SDL_MOUSEWHEEL: {
            int x = 0, y = 0;
            SDL_GetMouseState(&x, &y);
            w.kind = WindowEvent::Kind::Wheel;
            w.x = px(x);
            w.y = px(y);
            w.dx = e.wheel.x;
            w.dy = e.wheel.y;
            event(w);
            tell(input(CALOT_EVENT_MOUSE_WHEEL, 0, 0, e.wheel.x, e.wheel.y));
            break;
        }
        case SDL_CONTROLLERDEVICEADDED:
            if (SDL_GameController* pad = SDL_GameControllerOpen(e.cdevice.which))
                state_->pads.push_back(pad);
            break;
        case SDL_CONTROLLERAXISMOTION:
            tell(input(CALOT_EVENT_GAMEPAD_AXIS, e.caxis.axis, e.caxis.value / 32767.0));
            break;
        case SDL_CONTROLLERBUTTONDOWN:
        case SDL_CONTROLLERBUTTONUP:
            tell(input(CALOT_EVENT_GAMEPAD_BUTTON, e.cbutton.button,
                       e.type == SDL_CONTROLLERBUTTONDOWN ? 1 : 0));
            break;
        default:
            break;
        }
    }
}

int Window::width() const {
    int w = 0;
    SDL_GL_GetDrawableSize(state_->window, &w, nullptr);
    return w;
}

int Window::height() const {
    int h = 0;
    SDL_GL_GetDrawableSize(state_->window, nullptr, &h);
    return h;
}

void Window::swap() {
    SDL_GL_SwapWindow(state_->window);
}

void Window::set_fullscreen(bool on) {
    SDL_SetWindowFullscreen(state_->window, on ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
}

bool Window::is_fullscreen() const {
    return (SDL_GetWindowFlags(state_->window) & SDL_WINDOW_FULLSCREEN_DESKTOP) != 0;
}

void Window::set_visible(bool visible) {
    if (visible)
        SDL_ShowWindow(state_->window);
    else
        SDL_HideWindow(state_->window);
}

} // namespace calot::rendering
