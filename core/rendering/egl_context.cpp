#include "rendering/egl_context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace calot::rendering {

struct EglContext::State {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
};

namespace {

bool has_extension(const char* list, const char* name) {
    if (!list) return false;
    const std::size_t n = std::strlen(name);
    for (const char* p = std::strstr(list, name); p; p = std::strstr(p + 1, name))
        if ((p == list || p[-1] == ' ') && (p[n] == ' ' || p[n] == '\0')) return true;
    return false;
}

// A current context on an uninitialised display, or the reason why there is none.
std::string try_display(EGLDisplay display, EGLContext& context) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY) return "no display";
    if (!eglInitialize(display, &major, &minor)) return "cannot be initialised";
    const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
    std::string reason;
    if (!has_extension(extensions, "EGL_KHR_surfaceless_context")) {
        reason = "no context without a surface";
    } else if (!eglBindAPI(EGL_OPENGL_API)) {
        reason = "no desktop OpenGL";
    } else {
        const std::array<EGLint, 5> want{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
        EGLConfig config{};
        EGLint count = 0;
        if (!eglChooseConfig(display, want.data(), &config, 1, &count) || count < 1)
            config = EGL_NO_CONFIG_KHR;
        const std::array<EGLint, 7> attributes{EGL_CONTEXT_MAJOR_VERSION,
                                               3,
                                               EGL_CONTEXT_MINOR_VERSION,
                                               3,
                                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                               EGL_NONE};
        context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
        if (context == EGL_NO_CONTEXT) {
            reason = "no OpenGL 3.3 core context";
        } else if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
            eglDestroyContext(display, context);
            context = EGL_NO_CONTEXT;
            reason = "the context cannot be made current";
        }
    }
    if (!reason.empty()) eglTerminate(display);
    return reason;
}

} // namespace

void limit_software_threads() {
    setenv("LP_NUM_THREADS", "1", 0);
}

EglContext::EglContext() : state_(std::make_unique<State>()) {
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    std::string reasons;
    const auto attempt = [&](const char* what, EGLDisplay display) {
        const std::string reason = try_display(display, state_->context);
        if (reason.empty()) {
            state_->display = display;
            return true;
        }
        reasons += std::string(reasons.empty() ? "" : "; ") + what + ": " + reason;
        return false;
    };
    if (has_extension(client, "EGL_MESA_platform_surfaceless") &&
        attempt("surfaceless",
                eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)))
        return;
    if (has_extension(client, "EGL_EXT_platform_device")) {
        const auto query =
            reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
        std::array<EGLDeviceEXT, 16> devices{};
        EGLint count = 0;
        if (query && query(static_cast<EGLint>(devices.size()), devices.data(), &count))
            for (EGLint i = 0; i < count; ++i)
                if (attempt("device", eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT,
                                                            devices[static_cast<std::size_t>(i)], nullptr)))
                    return;
    }
    if (attempt("default display", eglGetDisplay(EGL_DEFAULT_DISPLAY))) return;
    throw std::runtime_error("EGL cannot make a context (" + reasons +
                             "); is libegl1 with a driver (libegl-mesa0) installed?");
}

EglContext::~EglContext() {
    release();
    eglDestroyContext(state_->display, state_->context);
    eglTerminate(state_->display);
}

void EglContext::make_current() {
    eglBindAPI(EGL_OPENGL_API);
    if (!eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context))
        throw std::runtime_error("EGL cannot make its context current on this thread");
}

void EglContext::release() {
    eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

} // namespace calot::rendering
