#include "daemon/apps/weft/table.hpp"

#include <algorithm>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

// Characters, not bytes: continuation bytes of UTF-8 take no room on the screen.
std::size_t text_width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string count_text(std::size_t count) {
  return count == 0 ? "." : std::to_string(count);
}

}  // namespace

std::string Table::text(const std::string& indent) const {
  std::vector<std::size_t> width;
  for (const auto& row : rows_) {
    width.resize(std::max(width.size(), row.size()));
    for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], text_width(row[k]));
  }
  std::string out;
  for (const auto& row : rows_) {
    std::string line = indent;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const std::string padding(width[k] - text_width(row[k]), ' ');
      const bool left = k == 0 || others_ == Align::left;
      line += (k == 0 ? "" : "  ") + (left ? row[k] + padding : padding + row[k]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

std::string confusion_text(const classifier::Confusion& confusion) {
  Table table;
  std::vector<std::string> head{""};
  for (std::size_t k = 0; k < confusion.classes(); ++k) head.push_back(std::to_string(k + 1));
  head.push_back("recall %");
  table.row(std::move(head));
  const std::vector<double> recall = confusion.recall();
  for (std::size_t t = 0; t < confusion.classes(); ++t) {
    std::vector<std::string> row{std::to_string(t + 1) + " " + confusion.labels[t]};
    std::size_t tested = 0;
    for (std::size_t p = 0; p < confusion.classes(); ++p) {
      row.push_back(count_text(confusion.at(t, p)));
      tested += confusion.at(t, p);
    }
    row.push_back(tested == 0 ? "-" : percent(recall[t]));
    table.row(std::move(row));
  }
  return table.text();
}

}  // namespace weft::daemon::cli
