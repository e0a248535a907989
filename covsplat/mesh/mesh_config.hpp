// Configuration of `covsplat mesh`.
#pragma once

#include "covsplat/core/config_field.hpp"

namespace covsplat {

/// From where and how finely the map is rendered for meshing.
struct ViewConfig {
  double spacing_m = 1.0;
  int columns = 1024;
  double lowest_deg = -75.0;
  double highest_deg = 75.0;
  double max_range_m = 30.0;
  double half_weight_range_m = 10.0;
  double min_alpha = 0.7;
  double max_disagreement = 0.05;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("spacing_m",
            c.spacing_m,
            Range{0.05, 100.0},
            "besides the keyframes, scans this far apart along the path are views");
    v.Field("columns",
            c.columns,
            Range{64, 16384},
            "columns of a rendered image over the full turn, a multiple of 4; rows are as far "
            "apart");
    v.Field("lowest_deg", c.lowest_deg, Range{-89.0, 88.0}, "lower end of a rendered image");
    v.Field("highest_deg", c.highest_deg, Range{-88.0, 89.0}, "upper end of a rendered image");
    v.Field("max_range_m",
            c.max_range_m,
            Range{1.0, 1000.0},
            "surfaces farther than this from a view are left to nearer views");
    v.Field("half_weight_range_m",
            c.half_weight_range_m,
            Range{0.1, 1e6},
            "a surface at this range counts half of one right before the view: far discs are "
            "smaller than pixels, which draws them towards the view");
    v.Field("min_alpha",
            c.min_alpha,
            Range{0.01, 0.999},
            "pixels rendered less opaque than this are not known");
    v.Field("max_disagreement",
            c.max_disagreement,
            Range{0.001, 10.0},
            "where expected and median range differ by more than this share of the range, a pixel "
            "mixes surfaces and counts little");
  }
};

enum class MeshMethod {
  kFusion,   ///< rendered views and discs in a signed distance field, contoured
  kPoisson,  ///< screened Poisson reconstruction of points on the discs
};

template <>
struct EnumNames<MeshMethod> {
  static constexpr std::array<EnumName<MeshMethod>, 2> kNames{
      {{MeshMethod::kFusion, "fusion"}, {MeshMethod::kPoisson, "poisson"}}};
};

/// How the map becomes a surface.
struct MeshConfig {
  MeshMethod method = MeshMethod::kFusion;
  double voxel_m = 0.0;
  double truncation_voxels = 2.0;
  double min_weight = 0.1;
  double surfel_weight = 3.0;
  double surfel_sigmas = 1.0;
  double bridge_voxels = 5.0;
  double sharpness = 0.9;
  double min_component_m2 = 0.005;
  int max_tile_blocks = 40000;
  int threads = 0;
  ViewConfig view;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("method",
            c.method,
            "fusion: rendered views in a signed distance field; poisson: screened Poisson "
            "reconstruction of points on the discs, for which only voxel_m, min_component_m2 and "
            "threads count");
    v.Field("voxel_m",
            c.voxel_m,
            Range{0.0, 10.0},
            "edge of a voxel; 0: chosen from the spacing of the map's Gaussians");
    v.Field("truncation_voxels",
            c.truncation_voxels,
            Range{2.0, 20.0},
            "distances are kept up to so many voxels from a surface");
    v.Field("min_weight",
            c.min_weight,
            Range{1e-3, 1e6},
            "voxels that were observed with less than this have no surface: a head-on view of an "
            "opaque surface counts 1");
    v.Field(
        "surfel_weight",
        c.surfel_weight,
        Range{0.0, 1e3},
        "what the Gaussians' own discs count in their middle, beside the views; 0: views alone");
    v.Field("surfel_sigmas",
            c.surfel_sigmas,
            Range{0.1, 5.0},
            "discs end after so many standard deviations: beyond, few measurements bear them out");
    v.Field("bridge_voxels",
            c.bridge_voxels,
            Range{0.0, 50.0},
            "gaps between discs are closed that come no farther than this from each of them");
    v.Field("sharpness",
            c.sharpness,
            Range{0.0, 1.0},
            "1: vertices at edges and corners lie where the planes around them meet; 0: in the "
            "middle of the crossings");
    v.Field("min_component_m2",
            c.min_component_m2,
            Range{0.0, 1e6},
            "unconnected pieces with less surface than this are dropped");
    v.Field("max_tile_blocks",
            c.max_tile_blocks,
            Range{64, 1e8},
            "memory: the field is made in tiles of at most so many blocks of 8 x 8 x 8 voxels (10 "
            "kB each)");
    v.Field("threads", c.threads, Range{0, 1024}, "threads in all; 0: one per processor");
    v.Section("view", c.view, "rendered views");
  }
};

}  // namespace covsplat
