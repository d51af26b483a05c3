#include "daemon/analysis/calibration/stroke_choice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "daemon/analysis/calibration/signal.hpp"
#include "daemon/analysis/calibration/stroke_summary.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double longest_stroke_mm = 200;
constexpr double dense_pitch_mm = 0.2;       // the bands end at 1.75 /mm
constexpr std::size_t window_samples = 200;  // 50 mm at 0.25 mm
constexpr double normalised_count = 1;
constexpr std::size_t pair_of_strokes = 2;
constexpr std::size_t cell_stride = 5;  // step to other conditions; not a factor of usual numbers
                                        // of conditions

using Indices = std::vector<std::size_t>;

struct CellStrokes {
  std::uint32_t mounting = 0;
  Indices strokes;  ///< sorted by repetition
};
struct ClothCells {
  std::string cloth;
  std::vector<CellStrokes> cells;  ///< in order of appearance
};

CellStrokes& cell_of(std::vector<ClothCells>& cloths, const Stroke& stroke,
                     std::map<std::pair<std::string, std::string>, std::size_t>& seen) {
  auto cloth = std::ranges::find(cloths, stroke.cloth, &ClothCells::cloth);
  if (cloth == cloths.end()) cloth = cloths.insert(cloths.end(), {stroke.cloth, {}});
  const auto [at, is_new] = seen.try_emplace({stroke.cloth, stroke.cell}, cloth->cells.size());
  if (is_new) cloth->cells.push_back({stroke.mounting, {}});
  return cloth->cells[at->second];
}

std::vector<ClothCells> list_cells(const RecordingView& view) {
  std::vector<ClothCells> out;
  std::map<std::pair<std::string, std::string>, std::size_t> seen;
  for (std::size_t i = 0; i < view.strokes.size(); ++i)
    cell_of(out, view.strokes[i], seen).strokes.push_back(i);
  for (ClothCells& cloth : out)
    for (CellStrokes& cell : cloth.cells)
      std::ranges::stable_sort(cell.strokes, {},
                               [&](std::size_t i) { return view.strokes[i].repetition; });
  return out;
}

std::size_t count_windows(const Stroke& stroke) {
  const double length_mm = static_cast<double>(stroke.samples()) * stroke.pitch_mm();
  return std::max({std::size_t{1}, static_cast<std::size_t>(length_mm / window_mm),
                   stroke.samples() / window_samples});
}

/// Alternates the mountings, each time with other conditions.
Indices order_of(const ClothCells& cloth, std::size_t number) {
  std::map<std::uint32_t, std::vector<const CellStrokes*>> by_mounting;
  for (const CellStrokes& cell : cloth.cells) by_mounting[cell.mounting].push_back(&cell);
  Indices out;
  for (std::size_t round = 0, left = cloth.cells.size(); left > 0; ++round)
    for (auto& [mounting, cells] : by_mounting) {
      if (cells.empty()) continue;
      const auto at = (number + cell_stride * (round + mounting)) % cells.size();
      const Indices& strokes = cells[at]->strokes;
      out.insert(
          out.end(), strokes.begin(),
          strokes.begin() + static_cast<std::ptrdiff_t>(std::min(pair_of_strokes, strokes.size())));
      cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(at));
      --left;
    }
  return out;
}

/// Strokes with equal keys keep the same pitch.
using Sampling = std::pair<std::string, double>;  // conditions, rate [Hz]

Sampling sampling_of(const Stroke& stroke) {
  return {stroke.conditions, stroke.rate_hz};
}

std::map<Sampling, std::size_t> find_strides(const RecordingView& view) {
  std::map<Sampling, std::size_t> out;
  for (const Stroke& stroke : view.strokes) {
    const auto stride =
        std::max<std::size_t>(1, static_cast<std::size_t>(dense_pitch_mm / stroke.pitch_mm()));
    const auto held = std::min(stride, std::max<std::size_t>(1, stroke.samples() / least_samples));
    const auto [at, is_new] = out.try_emplace(sampling_of(stroke), held);
    at->second = std::min(at->second, held);
  }
  return out;
}

void take_every(std::size_t stride, Stroke& stroke) {
  for (std::size_t c = 0; c < stroke.counts.size(); ++c) {
    std::vector<double> taken;
    for (std::size_t i = 0; i < stroke.counts[c].size(); i += stride)
      taken.push_back(stroke.counts[c][i]);
    stroke.counts[c] = std::move(taken);
    stroke.level[c] = mean(stroke.counts[c]);
  }
  stroke.rate_hz /= static_cast<double>(stride);
}

/// Every third cell; none if nothing would be left to fit.
bool holds_out_cell(std::size_t cell, std::size_t cells) {
  return cells >= 3 && cell % 3 == 2;
}

}  // namespace

RecordingView subset(const RecordingView& view, const Indices& indices) {
  RecordingView out = {{}, view.channels, view.recorded, view.recorded_channels, view.remarks};
  for (const std::size_t i : indices) out.strokes.push_back(view.strokes[i]);
  return out;
}

RecordingView strokes_of(const RecordingView& view, std::string_view cloth) {
  Indices own;
  for (std::size_t i = 0; i < view.strokes.size(); ++i)
    if (view.strokes[i].cloth == cloth) own.push_back(i);
  return subset(view, own);
}

RecordingView choose_strokes(const RecordingView& view, std::size_t windows) {
  std::vector<Indices> orders;
  for (const ClothCells& cloth : list_cells(view)) orders.push_back(order_of(cloth, orders.size()));
  Indices chosen;
  std::size_t taken = 0;
  for (std::size_t round = 0; taken < windows || round == 0; ++round) {
    bool any = false;
    for (const Indices& order : orders) {
      if (round >= order.size()) continue;
      any = true;
      const std::size_t more = count_windows(view.strokes[order[round]]);
      if (round > 0 && taken + more > windows) continue;
      chosen.push_back(order[round]);
      taken += more;
    }
    if (!any) break;
  }
  std::ranges::sort(chosen);  // recorded order, because the pads' memory depends on it
  return subset(view, chosen);
}

RecordingView cut_long_strokes(RecordingView view, std::size_t windows) {
  std::set<std::string_view> cloths;
  for (const Stroke& stroke : view.strokes) cloths.insert(stroke.cloth);
  const std::size_t share =
      window_samples * std::max<std::size_t>(1, windows / std::max<std::size_t>(1, cloths.size()));
  for (Stroke& stroke : view.strokes) {
    const auto most =
        std::min(share, static_cast<std::size_t>(longest_stroke_mm / stroke.pitch_mm()));
    if (stroke.samples() <= std::max(most, least_samples)) continue;
    for (std::size_t c = 0; c < stroke.counts.size(); ++c) {
      stroke.counts[c].resize(std::max(most, least_samples));
      stroke.level[c] = mean(stroke.counts[c]);
    }
  }
  return view;
}

RecordingView thin_dense_strokes(RecordingView view) {
  const auto strides = find_strides(view);
  std::size_t thinned = 0, largest = 1;
  for (Stroke& stroke : view.strokes) {
    const std::size_t stride = strides.at(sampling_of(stroke));
    if (stride == 1) continue;
    take_every(stride, stroke);
    ++thinned;
    largest = std::max(largest, stride);
  }
  if (thinned > 0)
    view.remarks.push_back("Strokes with samples closer than 0.1 mm: " + std::to_string(thinned) +
                           ". At least one sample in " + std::to_string(largest) +
                           " is used, so that samples are at most 0.2 mm apart.");
  return view;
}

RecordingView strokes_on_cloth(const RecordingView& view) {
  Indices out;
  for (std::size_t i = 0; i < view.strokes.size(); ++i) {
    const std::vector<double>& level = view.strokes[i].level;
    const auto lifted = std::ranges::count_if(level, [](double l) { return l < least_level; });
    if (2 * static_cast<std::size_t>(lifted) <= level.size()) out.push_back(i);
  }
  RecordingView chosen = subset(view, out);
  if (const std::size_t left = view.strokes.size() - out.size(); left > 0)
    chosen.remarks.push_back(
        std::string("Skipped because most channels have a level below 1 count") +
        (std::ranges::any_of(view.strokes, &Stroke::has_rest) ? " above phase S: " : ": ") +
        std::to_string(left) + (left == 1 ? " stroke." : " strokes."));
  return chosen;
}

std::string level_advice(const RecordingView& view) {
  std::vector<double> levels;
  double largest = 0;
  for (const Stroke& stroke : view.strokes) {
    levels.insert(levels.end(), stroke.level.begin(), stroke.level.end());
    for (const std::vector<double>& counts : stroke.counts)
      for (const double count : counts) largest = std::max(largest, std::abs(count));
  }
  if (median(std::move(levels)).value_or(0) <= -least_level)
    return "Change the sign of the counts: they decrease under load";
  if (largest <= normalised_count)
    return "Multiply normalised counts of 0 to 1, for example by 10000";
  return {};
}

RecordingView finest_strokes(const RecordingView& view) {
  double finest_mm = view.strokes.front().pitch_mm();
  for (const Stroke& stroke : view.strokes) finest_mm = std::min(finest_mm, stroke.pitch_mm());
  Indices out;
  for (std::size_t i = 0; i < view.strokes.size(); ++i)
    if (view.strokes[i].pitch_mm() <= same_pitch * finest_mm) out.push_back(i);
  return subset(view, out);
}

SplitView split_held_out(const RecordingView& view) {
  std::set<std::size_t> held;
  for (const ClothCells& cloth : list_cells(view))
    for (std::size_t c = 0; c < cloth.cells.size(); ++c) {
      const Indices& strokes = cloth.cells[c].strokes;
      const std::size_t count = strokes.size() >= 3                     ? strokes.size() / 3
                                : holds_out_cell(c, cloth.cells.size()) ? strokes.size()
                                                                        : 0;
      held.insert(strokes.end() - static_cast<std::ptrdiff_t>(count), strokes.end());
    }
  Indices fitted;
  for (std::size_t i = 0; i < view.strokes.size(); ++i)
    if (!held.contains(i)) fitted.push_back(i);
  SplitView out{subset(view, fitted), std::nullopt};
  if (!held.empty()) out.held_out = subset(view, {held.begin(), held.end()});
  return out;
}

}  // namespace weft::daemon::calibration
