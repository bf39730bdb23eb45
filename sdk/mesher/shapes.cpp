#include "shape.hpp"

#include <utility>

namespace calot::mesher {
namespace {

class Ellipsoid final : public Shape {
  public:
    Ellipsoid(Vec centre, Vec radii, Vec degrees, double exponent)
        : centre_(centre), radii_(radii), rotation_(Rotation::of_degrees(degrees)), exponent_(exponent) {
        bounds_ = Box::around(centre, rotation_.half_extents(radii));
    }
    /// (k - 1) / |grad k| with k the homogeneous gauge of the body: first-order distance.
    double value(Vec p) const override {
        const Vec q = rotation_.to_local(p - centre_);
        const Vec n{q.x / radii_.x, q.y / radii_.y, q.z / radii_.z};
        double gauge, slope;
        if (exponent_ == 2) {
            gauge = norm(n);
            slope = norm({n.x / radii_.x, n.y / radii_.y, n.z / radii_.z}) / gauge;
        } else {
            const double e = exponent_;
            const Vec a{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
            gauge = std::pow(std::pow(a.x, e) + std::pow(a.y, e) + std::pow(a.z, e), 1 / e);
            const double common = std::pow(gauge, 1 - e);
            slope = common * norm({std::pow(a.x, e - 1) / radii_.x, std::pow(a.y, e - 1) / radii_.y,
                                   std::pow(a.z, e - 1) / radii_.z});
        }
        const double deepest = -std::min({radii_.x, radii_.y, radii_.z});
        if (!(gauge > 1e-9) || !(slope > 0)) return deepest;
        return std::max(deepest, (gauge - 1) / slope);
    }

  private:
    Vec centre_, radii_;
    Rotation rotation_;
    double exponent_;
};

class Capsule final : public Shape {
  public:
    Capsule(Vec from, Vec to, double r0, double r1) : from_(from), axis_(to - from), r0_(r0), r1_(r1) {
        length2_ = dot(axis_, axis_);
        bounds_ = Box::around(from, {r0, r0, r0}).united(Box::around(to, {r1, r1, r1}));
    }
    double value(Vec p) const override {
        const double t = std::clamp(dot(p - from_, axis_) / length2_, 0.0, 1.0);
        return norm(p - from_ - t * axis_) - (r0_ + t * (r1_ - r0_));
    }

  private:
    Vec from_, axis_;
    double r0_, r1_, length2_ = 0;
};

class RoundBox final : public Shape {
  public:
    RoundBox(Vec centre, Vec size, double round, Vec degrees)
        : centre_(centre), half_(0.5 * size), round_(round), rotation_(Rotation::of_degrees(degrees)) {
        bounds_ = Box::around(centre, rotation_.half_extents(half_));
    }
    double value(Vec p) const override {
        const Vec q = rotation_.to_local(p - centre_);
        const Vec d{std::abs(q.x) - half_.x + round_, std::abs(q.y) - half_.y + round_,
                    std::abs(q.z) - half_.z + round_};
        const Vec out{std::max(d.x, 0.0), std::max(d.y, 0.0), std::max(d.z, 0.0)};
        return norm(out) + std::min(std::max({d.x, d.y, d.z}), 0.0) - round_;
    }

  private:
    Vec centre_, half_;
    double round_;
    Rotation rotation_;
};

class HalfSpace final : public Shape {
  public:
    HalfSpace(Vec point, Vec normal) : point_(point), normal_(normalised(normal)) {}
    double value(Vec p) const override { return dot(p - point_, normal_); }

  private:
    Vec point_, normal_;
};

double smooth_min(double a, double b, double blend) {
    if (blend <= 0) return std::min(a, b);
    const double h = std::max(blend - std::abs(a - b), 0.0) / blend;
    return std::min(a, b) - h * h * h * blend / 6;
}

double smooth_max(double a, double b, double blend) {
    return -smooth_min(-a, -b, blend);
}

class Union final : public Shape {
  public:
    Union(std::vector<ShapePtr> of, double blend) : of_(std::move(of)), blend_(blend) {
        bounds_ = of_.front()->bounds();
        for (const auto& s : of_)
            bounds_ = bounds_.united(s->bounds());
        bounds_ = bounds_.grown(blend_);
    }
    double value(Vec p) const override {
        double v = of_.front()->value(p);
        for (std::size_t i = 1; i < of_.size(); ++i) {
            // Far beyond the fillet a part cannot matter; the margin allows for fields that overstate
            // distances.
            if (of_[i]->bounds().distance(p) > 2 * std::max(v, 0.0) + 2 * blend_ + 2) continue;
            v = smooth_min(v, of_[i]->value(p), blend_);
        }
        return v;
    }

  private:
    std::vector<ShapePtr> of_;
    double blend_;
};

class Intersection final : public Shape {
  public:
    Intersection(std::vector<ShapePtr> of, double blend) : of_(std::move(of)), blend_(blend) {
        for (const auto& s : of_)
            bounds_ = bounds_.common(s->bounds());
    }
    double value(Vec p) const override {
        double v = of_.front()->value(p);
        for (std::size_t i = 1; i < of_.size(); ++i)
            v = smooth_max(v, of_[i]->value(p), blend_);
        return v;
    }

  private:
    std::vector<ShapePtr> of_;
    double blend_;
};

class Difference final : public Shape {
  public:
    Difference(std::vector<ShapePtr> of, double blend) : of_(std::move(of)), blend_(blend) {
        bounds_ = of_.front()->bounds();
    }
    double value(Vec p) const override {
        double v = of_.front()->value(p);
        for (std::size_t i = 1; i < of_.size(); ++i) {
            // Outside the cutter's box its field is about the distance: nothing to cut there.
            if (of_[i]->bounds().distance(p) > 2 * std::max(-v, 0.0) + 2 * blend_ + 2) continue;
            v = smooth_max(v, -of_[i]->value(p), blend_);
        }
        return v;
    }

  private:
    std::vector<ShapePtr> of_;
    double blend_;
};

class Shell final : public Shape {
  public:
    Shell(ShapePtr of, double inwards, double outwards)
        : of_(std::move(of)), middle_(0.5 * (outwards - inwards)), half_(0.5 * (outwards + inwards)) {
        bounds_ = of_->bounds().grown(outwards);
    }
    double value(Vec p) const override { return std::abs(of_->value(p) - middle_) - half_; }

  private:
    ShapePtr of_;
    double middle_, half_;
};

class Offset final : public Shape {
  public:
    Offset(ShapePtr of, double by) : of_(std::move(of)), by_(by) {
        bounds_ = of_->bounds().grown(std::max(by, 0.0));
    }
    double value(Vec p) const override { return of_->value(p) - by_; }

  private:
    ShapePtr of_;
    double by_;
};

class Placed final : public Shape {
  public:
    Placed(ShapePtr of, Vec move, Vec degrees, Vec about, double scale)
        : of_(std::move(of)), move_(move), about_(about), rotation_(Rotation::of_degrees(degrees)),
          scale_(scale) {
        const Box& b = of_->bounds();
        if (b.bounded()) {
            const Vec centre = 0.5 * (b.low + b.high), half = 0.5 * (b.high - b.low);
            bounds_ = Box::around(rotation_.to_world(scale_ * (centre - about_)) + about_ + move_,
                                  scale_ * rotation_.half_extents(half));
        }
    }
    double value(Vec p) const override {
        return scale_ * of_->value((1 / scale_) * rotation_.to_local(p - about_ - move_) + about_);
    }

  private:
    ShapePtr of_;
    Vec move_, about_;
    Rotation rotation_;
    double scale_;
};

} // namespace

ShapePtr make_ellipsoid(Vec centre, Vec radii, Vec rotate_degrees, double exponent) {
    return std::make_shared<Ellipsoid>(centre, radii, rotate_degrees, exponent);
}
ShapePtr make_capsule(Vec from, Vec to, double radius_from, double radius_to) {
    return std::make_shared<Capsule>(from, to, radius_from, radius_to);
}
ShapePtr make_box(Vec centre, Vec size, double round, Vec rotate_degrees) {
    return std::make_shared<RoundBox>(centre, size, round, rotate_degrees);
}
ShapePtr make_half_space(Vec point, Vec normal) {
    return std::make_shared<HalfSpace>(point, normal);
}
ShapePtr make_union(std::vector<ShapePtr> of, double blend) {
    return std::make_shared<Union>(std::move(of), blend);
}
ShapePtr make_intersection(std::vector<ShapePtr> of, double blend) {
    return std::make_shared<Intersection>(std::move(of), blend);
}
ShapePtr make_difference(std::vector<ShapePtr> of, double blend) {
    return std::make_shared<Difference>(std::move(of), blend);
}
ShapePtr make_shell(ShapePtr of, double inwards, double outwards) {
    return std::make_shared<Shell>(std::move(of), inwards, outwards);
}
ShapePtr make_offset(ShapePtr of, double by) {
    return std::make_shared<Offset>(std::move(of), by);
}
ShapePtr make_placed(ShapePtr of, Vec move, Vec rotate_degrees, Vec about, double scale) {
    return std::make_shared<Placed>(std::move(of), move, rotate_degrees, about, scale);
}

} // namespace calot::mesher
