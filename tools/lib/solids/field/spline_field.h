// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "config/solids/solid_file.h"
#include "tools/lib/solids/field/sampled_field.h"

/// A sampled field as the force loop reads it.
namespace hapticd::solids {

/// Returns the solid whose quadratic B-spline passes through the samples of a field, rounded to 16 bits of
/// its largest distance. `field`: at least rt::kMinGridSamples along each axis.  Thread: any.  RT: not safe.
std::shared_ptr<const config::Solid> splineOf(const SampledField& field, config::Solid::About about);

/// Reads a field as the force loop reads that solid: FieldOptions::reader.
FieldValue splineReader(const SampledField& field);

}  // namespace hapticd::solids
