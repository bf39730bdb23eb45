// Flat parts of the picture: the endoscope's mask, the external view's background, the fade.
#pragma once

#include "rendering/gl_objects.hpp"

namespace calot::rendering {

class PictureShapes {
  public:
    PictureShapes();
    void draw_mask(const Program& flat) const;      // writes depth: nearest
    void draw_mask_edge(const Program& flat) const; // soft inner edge, over the picture
    void draw_background(const Program& flat) const;
    void draw_fade(const Program& flat, float amount) const;

  private:
    struct Part {
        int first = 0, count = 0;
    };
    Part surround_, edge_, background_, fade_;
    VertexArray array_;
    Buffer vertices_;
};

} // namespace calot::rendering
