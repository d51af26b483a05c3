#pragma once
// What is fitted: parameters with bounds, and what the plant makes of their values.

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
  estimator,  ///< computed from the recordings, not searched for
  cloth,      ///< of one cloth
  common,     ///< of all cloths
  fixed       ///< an estimate that stays: varied only to see what it can be mistaken for
};

struct Parameter {
  std::string name;   ///< key of the cloth table, with its unit: "height_um"
  std::string cloth;  ///< empty: of all cloths
  Block block = Block::common;
  double low = 0, high = 1;  ///< bounds, natural scale
  bool logarithmic = false;
  bool is_off_at_low = false;  ///< the lower bound means: this mechanism does nothing
  std::string reason;          ///< of the bounds
  double start = 0;            ///< the estimate before

  [[nodiscard]] std::string label() const { return cloth.empty() ? name : name + " of " + cloth; }
  /// Place between the bounds, 0 to 1, on the parameter's own scale; outside: held at the bound.
  [[nodiscard]] double to_unit(double value) const;
  [[nodiscard]] double from_unit(double unit) const;
};

/// A label of the recordings and the cloth of the table whose KES figures and yarns it takes.
struct BaseCloth {
  std::string label;
  sim::Fabric fabric;     ///< named as the label
  std::string taken;      ///< name in the table
  bool is_named = false;  ///< found by its name; else the table's cloth of median stiffness
};

/// Values are in the order of parameters(), on the natural scale; counts are those of the recorded
/// sensor, `scale()` times the plant's and the table's.
class ClothModel {
 public:
  /// A cloth per label of the view. A label takes the longest name of the table that is in it,
  /// whatever its case: "BrownCotton" is cotton. Errors: not_found (a table without cloths), range
  /// (a cloth that no law fits). `scale`: nothing: that of the view (press.hpp). One model, so one
  /// scale, is for all strokes of a calibration.
  static Result<ClothModel> make(const RecordingView& view, const sim::FabricLibrary& library,
                                 std::optional<double> scale = {});

  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  [[nodiscard]] const std::vector<BaseCloth>& cloths() const { return cloths_; }
  [[nodiscard]] std::vector<double> start() const;
  /// Counts of the recorded sensor per count of the plant's, at least 1.
  [[nodiscard]] double scale() const { return scale_; }
  /// Its number; parameters().size(): there is none.
  [[nodiscard]] std::size_t find(std::string_view name, std::string_view cloth = {}) const;
  /// Numbers of the parameters of one block, of one cloth where it is named.
  [[nodiscard]] std::vector<std::size_t> block(Block block, std::string_view cloth = {}) const;

  struct Inputs {
    sim::Fabric fabric;
    sim::MaterialParams params;
    sim::Spread spread;   ///< none between pieces: the recorded piece is what is calibrated
    sim::PadParams pads;  ///< in the plant's counts
    double grip_n_m = 0;  ///< stiffness of what pressed in the recordings; of no table
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

/// The structure with the share of its lines changed, random parts in proportion, and the random
/// band from `low_per_m` on.
sim::Structure reshaped(sim::Structure structure, double line_share, double low_per_m);
double line_share(const sim::Structure& structure);

}  // namespace weft::daemon::calibration
