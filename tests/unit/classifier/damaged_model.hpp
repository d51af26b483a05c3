#pragma once
// Model files that no reader takes.

#include <catch2/catch.hpp>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::classifier::testing {

/// What every stored model with a header line and a checksum is refused for: an altered byte behind
/// the header of `header_size`, an end that is missing, another version, another kind of file.
template <class Load>
void check_damage_is_refused(const std::string& text, std::size_t header_size, const Load& load) {
  for (std::size_t at = header_size + 1; at < text.size(); at += 7) {
    std::string bad = text;
    bad[at] = bad[at] == 'x' ? 'y' : 'x';
    INFO("byte " << at);
    const auto model = load(bad);
    REQUIRE(!model);
    CHECK(model.error().code == Errc::corrupt);
  }
  for (const std::size_t size : {text.size() - 1, text.size() / 2, std::size_t{24}}) {
    INFO(size << " bytes");
    CHECK(!load(text.substr(0, size)));
  }
  std::string newer = text;
  newer[header_size - 1] = '9';
  CHECK(load(newer).error().code == Errc::unsupported);
  CHECK(load("weft-fabric-model 5\n").error().code == Errc::parse);
  CHECK(load("").error().code == Errc::parse);
}

}  // namespace weft::classifier::testing
