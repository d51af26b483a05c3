#pragma once
// The fitted parameters with their bounds, and the plant inputs made from their values.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/calibration/recording_view.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/pads.hpp"

namespace weft::daemon::calibration {

enum class Block {
  estimator,  ///< computed from the recordings without a search
  cloth,      ///< belongs to one fabric
  common,     ///< common to all fabrics
  fixed       ///< keeps its estimate: varied only to find what it can be confused with
};

struct Parameter {
  std::string name;   ///< key of the fabric table, with its unit: "height_um"
  std::string cloth;  ///< empty: common to all fabrics
  Block block = Block::common;
  double low = 0, high = 1;  ///< bounds, natural scale
  bool logarithmic = false;
  bool is_off_at_low = false;  ///< the lower bound switches this mechanism off
  std::string reason;          ///< reason for the bounds
  double start = 0;            ///< the initial estimate

  [[nodiscard]] std::string label() const { return cloth.empty() ? name : name + " of " + cloth; }
  /// Position between the bounds, 0 to 1, on the parameter's own scale; clamped to the bounds.
  [[nodiscard]] double to_unit(double value) const;
  [[nodiscard]] double from_unit(double unit) const;
};

/// A label of the recordings, and the fabric of the table that supplies its KES values and yarns.
struct BaseCloth {
  std::string label;
  sim::Fabric fabric;     ///< with the label as its name
  std::string taken;      ///< name in the table
  bool is_named = false;  ///< found by its name; otherwise the table's fabric of median stiffness
};

/// Values are in the order of parameters(), on the natural scale. Counts are those of the recorded
/// sensor: `scale()` times the counts of the plant and of the table.
class ClothModel {
 public:
  /// One fabric per label of the view. A label uses the longest fabric name of the table that it
  /// contains, ignoring case: "BrownCotton" is cotton. Errors: not_found (a table without fabrics),
  /// range (a fabric that no law fits). `scale` empty: the scale of the view (press.hpp). One
  /// model, and so one scale, serves all strokes of a calibration.
  static Result<ClothModel> make(const RecordingView& view, const sim::FabricLibrary& library,
                                 std::optional<double> scale = {});

  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  [[nodiscard]] const std::vector<BaseCloth>& cloths() const { return cloths_; }
  [[nodiscard]] std::vector<double> start() const;
  /// Counts of the recorded sensor per count of the plant's, at least 1.
  [[nodiscard]] double scale() const { return scale_; }
  /// Index of the parameter; parameters().size() if there is none.
  [[nodiscard]] std::size_t find(std::string_view name, std::string_view cloth = {}) const;
  /// Indices of the parameters of one block, and of one fabric if named.
  [[nodiscard]] std::vector<std::size_t> block(Block block, std::string_view cloth = {}) const;

  struct Inputs {
    sim::Fabric fabric;
    sim::MaterialParams params;
    sim::Spread spread;   ///< zero between pieces: the recorded piece itself is calibrated
    sim::PadParams pads;  ///< in the plant's counts
    double grip_n_m = 0;  ///< stiffness of the pressing mechanism in the recordings; not in the
                          ///< table
  };
  /// `cloth`: a label of the view.
  [[nodiscard]] Inputs inputs(std::string_view cloth, std::span<const double> values) const;

 private:
  Status add_cloth(const std::string& label, const sim::FabricLibrary& library);
  void add_common(const sim::FabricLibrary& library);

  sim::MaterialParams params_;
  sim::Spread spread_;
  sim::PadParams pads_;
  double scale_ = 1;
  std::vector<BaseCloth> cloths_;
  std::vector<Parameter> parameters_;
};

/// The structure with another share of its lines, random parts in proportion, and with the random
/// band starting at `low_per_m`.
sim::Structure reshaped(sim::Structure structure, double line_share, double low_per_m);
double line_share(const sim::Structure& structure);

}  // namespace weft::daemon::calibration
