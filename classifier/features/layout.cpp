#include "classifier/features/layout.hpp"

#include <algorithm>

namespace weft::classifier {
namespace {

struct BlockText {
  std::string_view name;    // column name, as in the Python reference
  std::string_view symbol;  // symbol in Table I
  std::string_view unit;
};

// In the order of Block.
constexpr std::array<BlockText, 15> block_texts = {{{"mean.P", "F_mean^P", "count"},
                                                    {"diff.SP", "F_diff^S,P", "count"},
                                                    {"diff.PE", "F_diff^P,E", "count"},
                                                    {"max", "F_max", "count"},
                                                    {"min", "F_min", "count"},
                                                    {"mean", "F_mean", "count"},
                                                    {"var", "F_var", "count^2"},
                                                    {"norm", "F_norm", "count"},
                                                    {"kurt", "F_kurt", "1"},
                                                    {"skew", "F_skew", "1"},
                                                    {"range", "F_range", "count"},
                                                    {"mode", "F_mode", "count"},
                                                    {"m5", "F_5th", "count^5"},
                                                    {"Hfrq", "F_H.frq", "count"},
                                                    {"Sh", "F_S.h", "count"}}};
static_assert(block_texts.size() == static_cast<std::size_t>(Block::sh) + 1);

const BlockText& text_of(Block block) {
  return block_texts[static_cast<std::size_t>(block)];
}

FeatureInfo whole_pad(Block block) {
  const BlockText& text = text_of(block);
  return {std::string(text.name), std::string(text.symbol), block, 0, text.unit};
}

FeatureInfo one_taxel(Block block, std::size_t taxel) {
  const BlockText& text = text_of(block);
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

BlockSet FeatureLayout::blocks_of(std::span<const std::size_t> columns) const {
  if (columns.empty()) return BlockSet::all();
  BlockSet out;
  for (const std::size_t column : columns) out.add(columns_[column].block);
  return out;
}

std::vector<std::string> FeatureLayout::names() const {
  std::vector<std::string> out;
  out.reserve(columns_.size());
  for (const FeatureInfo& column : columns_) out.push_back(column.name);
  return out;
}

}  // namespace weft::classifier
