#include "pbrdf/processor.hpp"

#include "pbrdf/isa.hpp"

namespace pbrdf {

std::string instruction_set() { return "v" + std::to_string(static_cast<int>(isa())); }

}  // namespace pbrdf
