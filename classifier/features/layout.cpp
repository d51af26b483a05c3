#include "classifier/features/layout.hpp"

#include <algorithm>

namespace weft::classifier {
namespace {

struct BlockText {
  std::string_view name;    // column name, as in the Python reference
  std::string_view symbol;  // Table I
  std::string_view unit;
};

BlockText format_text(Block block) {
  switch (block) {
    case Block::mean_p:
      return {"mean.P", "F_mean^P", "count"};
    case Block::diff_sp:
      return {"diff.SP", "F_diff^S,P", "count"};
    case Block::diff_pe:
      return {"diff.PE", "F_diff^P,E", "count"};
    case Block::max:
      return {"max", "F_max", "count"};
    case Block::min:
      return {"min", "F_min", "count"};
    case Block::mean:
      return {"mean", "F_mean", "count"};
    case Block::var:
      return {"var", "F_var", "count^2"};
    case Block::norm:
      return {"norm", "F_norm", "count"};
    case Block::kurt:
      return {"kurt", "F_kurt", "1"};
    case Block::skew:
      return {"skew", "F_skew", "1"};
    case Block::range:
      return {"range", "F_range", "count"};
    case Block::mode:
      return {"mode", "F_mode", "count"};
    case Block::m5:
      return {"m5", "F_5th", "count^5"};
    case Block::hfrq:
      return {"Hfrq", "F_H.frq", "count"};
    case Block::sh:
      return {"Sh", "F_S.h", "count"};
  }
  return {};
}

FeatureInfo whole_pad(Block block) {
  const BlockText text = format_text(block);
  return {std::string(text.name), std::string(text.symbol), block, 0, text.unit};
}

FeatureInfo one_taxel(Block block, std::size_t taxel) {
  const BlockText text = format_text(block);
  const std::string number = std::to_string(taxel);
  return {std::string(text.name) + ".M." + number, std::string(text.symbol) + "^M." + number, block,
          taxel, text.unit};
}

}  // namespace

PhaseSet phases_of(const Trial& trial) {
  const auto has = [&](Phase p) {
    return std::find(trial.phase.begin(), trial.phase.end(), p) != trial.phase.end();
  };
  return {has(Phase::rest), has(Phase::press), has(Phase::end)};
}

FeatureLayout::FeatureLayout(std::size_t taxels, PhaseSet phases)
    : taxels_(taxels), phases_(phases) {
  if (phases.press) columns_.push_back(whole_pad(Block::mean_p));
  if (phases.press && phases.rest) columns_.push_back(whole_pad(Block::diff_sp));
  if (phases.press && phases.end) columns_.push_back(whole_pad(Block::diff_pe));
  for (const Block block : taxel_blocks) {
    for (std::size_t taxel = 1; taxel <= taxels; ++taxel) {
      columns_.push_back(one_taxel(block, taxel));
    }
  }
}

std::vector<std::string> FeatureLayout::names() const {
  std::vector<std::string> out;
  out.reserve(columns_.size());
  for (const FeatureInfo& column : columns_) out.push_back(column.name);
  return out;
}

}  // namespace weft::classifier
