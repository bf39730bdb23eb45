// Owners of OpenGL objects, and shader programs read from files.
#pragma once

#include <epoxy/gl.h>

#include <filesystem>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace calot::rendering {

// Owns one OpenGL name; Delete frees it. The context must be current when it dies.
template<void (*Delete)(GLuint)>
class GlName {
  public:
    GlName() = default;
    explicit GlName(GLuint name) : name_(name) {}
    GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
    GlName& operator=(GlName&& other) noexcept {
        std::swap(name_, other.name_);
        return *this;
    }
    ~GlName() {
        if (name_) Delete(name_);
    }
    GLuint operator*() const { return name_; }
    explicit operator bool() const { return name_ != 0; }

  private:
    GLuint name_ = 0;
};

namespace detail {
inline void free_buffer(GLuint n) {
    glDeleteBuffers(1, &n);
}
inline void free_array(GLuint n) {
    glDeleteVertexArrays(1, &n);
}
inline void free_texture(GLuint n) {
    glDeleteTextures(1, &n);
}
inline void free_renderbuffer(GLuint n) {
    glDeleteRenderbuffers(1, &n);
}
inline void free_framebuffer(GLuint n) {
    glDeleteFramebuffers(1, &n);
}
inline void free_program(GLuint n) {
    glDeleteProgram(n);
}
} // namespace detail

using Buffer = GlName<detail::free_buffer>;
using VertexArray = GlName<detail::free_array>;
using Texture = GlName<detail::free_texture>;
using Renderbuffer = GlName<detail::free_renderbuffer>;
using Framebuffer = GlName<detail::free_framebuffer>;

Buffer make_buffer();
VertexArray make_vertex_array();
Texture make_texture();
Renderbuffer make_renderbuffer();
Framebuffer make_framebuffer();

/// A linked program. Uniforms are set on the program that is in use; names it does not have are ignored.
class Program {
  public:
    Program() = default;

    /// Files of `folder`; `geometry` may be empty; each define becomes "#define X" at the top. A line
    /// `#include "file"` is replaced by that file of the same folder (not recursively).
    /// Throws std::runtime_error with file and the driver's message.
    Program(const std::filesystem::path& folder, const std::string& vertex, const std::string& geometry,
            const std::string& fragment, const std::vector<std::string>& defines);

    void use() const { glUseProgram(*name_); }
    GLint uniform(const char* name) const;
    void set(const char* name, int value) const { glUniform1i(uniform(name), value); }
    void set(const char* name, float value) const { glUniform1f(uniform(name), value); }
    void set(const char* name, float x, float y) const { glUniform2f(uniform(name), x, y); }
    void set3(const char* name, const float* v) const { glUniform3fv(uniform(name), 1, v); }
    void set4(const char* name, const float* v) const { glUniform4fv(uniform(name), 1, v); }
    void set_matrix3(const char* name, const float* column_major) const {
        glUniformMatrix3fv(uniform(name), 1, GL_FALSE, column_major);
    }

  private:
    GlName<detail::free_program> name_;
    mutable std::unordered_map<std::string, GLint> uniforms_;
};

/// Renderer and version of the current context, for logs and timings.
std::string describe_context();

/// True if the current context draws on the processor (Mesa's llvmpipe, softpipe, swrast).
bool draws_on_processor();

/// The folder of shaders: `given` if not empty, else $CALOT_ASSETS/shaders, else assets/shaders or
/// share/calot/shaders beside one of the folders above the running program.
/// Throws std::runtime_error that lists the places looked at.
std::filesystem::path find_shaders(const std::filesystem::path& given = {});

} // namespace calot::rendering
