#include "daemon/analysis/calibration/usable_views.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "daemon/analysis/calibration/signal.hpp"
#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::calibration {
namespace {

bool has_cloth(const RecordingView& view, std::string_view cloth) {
  return std::ranges::find(view.strokes, cloth, &Stroke::cloth) != view.strokes.end();
}

RecordingView usable_strokes(const RecordingView& view, std::size_t windows) {
  return strokes_on_cloth(cut_long_strokes(thin_dense_strokes(view), windows));
}

/// Mean over the channels.
double largest_level(const RecordingView& view) {
  double out = mean(view.strokes.front().level);
  for (const Stroke& stroke : view.strokes) out = std::max(out, mean(stroke.level));
  return out;
}

/// Names in a table are in lower case.
Status check_labels(const RecordingView& view) {
  std::map<std::string, std::string> labels;
  for (const Stroke& stroke : view.strokes) {
    const auto [at, is_new] = labels.try_emplace(name_in_table({}, stroke.cloth), stroke.cloth);
    if (is_new || at->second == stroke.cloth) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = "recordings",
                 .what = "labels differ in case only",
                 .expected = "a distinct name for each fabric",
                 .got = stroke.cloth,
                 .hint = "Rename one label, or give both the same label"});
  }
  return {};
}

Status check_held_out_view(const RecordingView& fitted, const RecordingView& held_out) {
  if (held_out.recorded_channels != fitted.recorded_channels)
    return fail({.code = Errc::invalid_argument,
                 .where = "--held-out",
                 .what = "number of channels differs from the recordings",
                 .expected = std::to_string(fitted.recorded_channels),
                 .got = std::to_string(held_out.recorded_channels)});
  for (const Stroke& stroke : held_out.strokes)
    if (!has_cloth(fitted, stroke.cloth))
      return fail({.code = Errc::invalid_argument,
                   .where = "--held-out",
                   .what = "fabric not in the fit",
                   .expected = "a fabric of the recordings",
                   .got = stroke.cloth});
  return {};
}

/// Leaves out fabrics that were not fitted because all their strokes were off the fabric.
RecordingView strokes_of_fitted(const RecordingView& view, const RecordingView& fitted) {
  std::vector<std::size_t> kept;
  std::set<std::string> dropped;
  for (std::size_t i = 0; i < view.strokes.size(); ++i)
    if (has_cloth(fitted, view.strokes[i].cloth))
      kept.push_back(i);
    else
      dropped.insert(view.strokes[i].cloth);
  RecordingView out = subset(view, kept);
  for (const std::string& cloth : dropped)
    out.remarks.push_back("All fitted strokes of " + cloth +
                          " are off the fabric: it is not checked.");
  return out;
}

/// Each fabric is simulated in every evaluation, so each needs a window.
Status check_cloths(const RecordingView& fitted, std::size_t windows) {
  std::set<std::string_view> cloths;
  for (const Stroke& stroke : fitted.strokes) cloths.insert(stroke.cloth);
  if (cloths.size() <= windows) return {};
  return fail({.code = Errc::invalid_argument,
               .where = "recordings",
               .what = "too many fabrics for one fit",
               .expected = "at most " + std::to_string(windows),
               .got = std::to_string(cloths.size()),
               .hint =
                   "Fit a part of the recordings, then the others with the table written by the "
                   "first fit (--fabrics)"});
}

}  // namespace

Result<UsableViews> usable_views(const RecordingView& fitted,
                                 const std::optional<RecordingView>& held_out,
                                 std::size_t windows) {
  if (held_out)
    if (Status ok = check_held_out_view(fitted, *held_out); !ok) return pass(ok.error());
  UsableViews out{usable_strokes(fitted, windows), std::nullopt};
  if (out.fitted.strokes.empty())
    return fail({.code = Errc::measurement,
                 .where = "recordings",
                 .what = "no stroke on the fabric",
                 .expected = "a level of at least 1 count in half of the channels",
                 .got = general(largest_level(fitted)),
                 .hint = level_advice(fitted)});
  if (Status ok = check_labels(out.fitted); !ok) return pass(ok.error());
  if (Status ok = check_cloths(out.fitted, windows); !ok) return pass(ok.error());
  if (held_out) out.held_out = strokes_of_fitted(usable_strokes(*held_out, windows), out.fitted);
  return out;
}

}  // namespace weft::daemon::calibration
