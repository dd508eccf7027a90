"""All metrics by name, in the order in which they are measured."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.decoding import decode_memory, decode_speed
from benchmarks.filter_speed import realtime_factor
from benchmarks.gradient import gradient_ratio
from benchmarks.iteration import border_ratio, over_lapack
from benchmarks.memory import peak_memory
from benchmarks.metric import Metric
from benchmarks.placement_study import placement_study
from benchmarks.selected_inverse import selected_inverse
from benchmarks.sparse_poser import sparse_poser, sparse_poser_default
from benchmarks.start_up import cold_start, warm_overhead

METRICS: dict[str, Callable[[], Metric]] = {
    "optimise_iteration_over_lapack": over_lapack,
    "border_cost_ratio": border_ratio,
    "selected_inverse_over_factor": selected_inverse,
    "gradient_over_iteration": gradient_ratio,
    "ekf_realtime_factor": realtime_factor,
    "cold_start_s": cold_start,
    "warm_overhead_s": warm_overhead,
    "peak_memory_gb_20000_frames": peak_memory,
    "decode_realtime_factor": decode_speed,
    "decode_peak_memory_gb_10_min": decode_memory,
    "placement_study_s": placement_study,
    "sparse_poser_20_iterations_s": sparse_poser,
    "sparse_poser_default_20_iterations_s": sparse_poser_default,
}
