// A window with an OpenGL context, through SDL and EGL. The only file pair that knows SDL.
#pragma once

#include "rendering/overlay.hpp"

#include <calot/abi/device.h>

#include <functional>
#include <memory>
#include <string>

namespace calot::rendering {

/// What the user did, beyond what devices are told (calot_input_event).
struct WindowEvent {
    enum class Kind {
        Close,
        KeyDown,
        MouseMove,
        MouseDown,
        MouseUp,
        Wheel,
        Resized,
        Input
    } kind = Kind::Input;
    int key = 0;               // KeyDown: SDL scancode
    bool repeated = false;     // KeyDown: by holding the key
    int button = 0;            // 1 left, 2 middle, 3 right
    int x = 0, y = 0;          // pixels of the picture, of the pointer
    double dx = 0, dy = 0;     // MouseMove: pixels moved; Wheel: notches
    calot_input_event input{}; // Input only
};

/// SDL's scancodes (USB HID usage numbers) of the keys that the window itself uses.
enum WindowKey : int {
    kKeyReturn = 40,
    kKeyEscape = 41,
    kKeyF1 = 58,
    kKeyF2 = 59,
    kKeyF3 = 60,
    kKeyF11 = 68
};

/// All functions on the thread that made it, the program's first.
class Window {
  public:
    /// Throws std::runtime_error: no display, no OpenGL 3.3 core.
    Window(const std::string& title, int width, int height);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// Hands over what happened since the last call; what one key press means to a device comes as Input as
    /// well as KeyDown. ImGui of `overlay` gets its share first.
    void poll(Overlay* overlay, const std::function<void(const WindowEvent&)>& event);

    void connect(Overlay&);            // after the overlay is made; then its ImGui gets the window's events
    void disconnect();                 // before the overlay goes
    std::function<void()> new_frame(); // for Overlay::begin

    int width() const; // of the framebuffer, pixels
    int height() const;
    void swap();
    void set_fullscreen(bool on);
    bool is_fullscreen() const;
    void set_visible(bool visible);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace calot::rendering
