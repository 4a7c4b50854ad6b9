"""The training of the detectors' networks, in torch."""

import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
import torch
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from regrasp.app.studies.detector.network import Network, Weights, load_weights

# torch's optimizers load Triton, which nothing here uses. Loaded after Mesa's OpenGL it crashes the process.
sys.modules.setdefault("triton", None)  # type: ignore[arg-type]

Batch = tuple[torch.Tensor, torch.Tensor]  # inputs, and what is wanted of the network


@dataclass(frozen=True)
class TrainingParameters:
    """How the network learns."""

    learning_rate: float = 4e-3  # at its peak; choice: usual for AdamW on a small network; not tuned
    restart_factor: float = 0.25  # of the learning rate, for a network that was trained before; choice
    weight_decay: float = 1e-4  # of AdamW; choice: usual
    check_every: int = 6000  # steps; choice: a check takes as long as some 300 of them
    batches_ahead: int = 3  # made while the network learns; choice
    averaging: float = 0.0  # share of its old value that the moving average of the weights keeps a step; 0: no average
    # bfloat16 takes two thirds of the time where the processor has instructions for it, and far longer elsewhere.
    # torch has no public function that tells.
    bfloat16: bool = field(default_factory=torch.cpu._is_avx512_bf16_supported)


def train(
    network: Network,
    draw: Callable[[np.random.Generator], Batch],
    precision: Callable[[Network], float],
    seed: int,
    steps: int,
    keep: Callable[[Network, float], None],
    report_progress: Callable[[int, str], None] = lambda _step, _words: None,
    start: tuple[Weights, torch.Tensor] | None = None,
    parameters: TrainingParameters = TrainingParameters(),
) -> None:
    """Train a network for so many steps, from its weights, or from those of `start` at a lower learning rate.

    `draw` makes a batch: inputs (n, channels, h / 2, w / 2), and what is wanted of the network as in `loss`.
    `precision` tells how good the network is on pictures that it does not learn from; `keep` is called with each that
    is the best so far, and with its precision. `start` has weights, and inputs for which to set the normalizations.
    `report_progress` is called with the step and a text after every step. One thread learns, another draws the next
    batches. The same seed gives the same network on the same kind of machine.
    """
    torch.set_num_threads(1)
    network.to(memory_format=torch.channels_last)  # 1.4 times as fast on a processor
    best, rate, draws = -1.0, parameters.learning_rate, [seed]
    if start is not None:
        load_weights(network, *start)
        best = precision(network)
        rate, draws = rate * parameters.restart_factor, [seed, 1]  # other batches
        keep(network, best)
    optimizer = torch.optim.AdamW(network.parameters(), rate, weight_decay=parameters.weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=steps)
    # Its weights change from step to step: their average may be kept, after Polyak and Juditsky 1992.
    average = AveragedModel(network, multi_avg_fn=get_ema_multi_avg_fn(parameters.averaging), use_buffers=True)
    for step, (images, wanted) in enumerate(_batches(draw, draws, steps, parameters.batches_ahead), 1):
        with torch.autocast("cpu", torch.bfloat16, enabled=parameters.bfloat16):
            maps = network(images)
        error = loss(maps.float(), wanted)
        optimizer.zero_grad()
        error.backward()
        optimizer.step()
        schedule.step()
        average.update_parameters(network)
        report_progress(step, f"loss {error.item():.2f}, best AP50 {max(best, 0):.3f}")
        if step % parameters.check_every == 0 or step == steps:
            score = precision(average.module)
            if score > best:
                best = score
                keep(average.module, score)


def loss(maps: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
    r"""The loss of CenterNet (Zhou et al. 2019), of maps (n, classes * (1 + k), h, w) of `Network`.

    `wanted` (n, classes, 3 + k, h, w) holds for each class the likelihood's target t, its k values, v and w:

    .. math:: L = -\frac{1}{N} \sum_x w_x
        \begin{cases} (1 - p_x)^2 \log p_x & t_x = 1 \\ (1 - t_x)^4 p_x^2 \log (1 - p_x) & t_x < 1 \end{cases}
        + \frac{\sum_x v_x \lVert y_x - \hat y_x \rVert_1}{\sum_x v_x}

    over cells x: a focal loss of the likelihood p against its target t, weighted by w, N the number of things; and the
    absolute errors of the values y, weighted by v.
    """
    classes = wanted.shape[1]
    values = maps[:, classes:].unflatten(1, (classes, -1))
    heat, truth, valid, weight = (
        maps[:, :classes].clamp(1e-4, 1 - 1e-4),
        wanted[:, :, 0],
        wanted[:, :, -2],
        wanted[:, :, -1],
    )
    peak = (truth == 1).float()
    focal = peak * (1 - heat) ** 2 * heat.log() + (1 - peak) * (1 - truth) ** 4 * heat**2 * (1 - heat).log()
    error = (values - wanted[:, :, 1:-2]).abs() * valid[:, :, None]
    return -(focal * weight).sum() / peak.sum().clamp(min=1) + error.sum() / valid.sum().clamp(min=1)


def _batches(
    draw: Callable[[np.random.Generator], Batch], draws: Sequence[int], steps: int, ahead: int
) -> Iterator[Batch]:
    """A batch for each step; the next few are drawn while the network learns."""
    with ThreadPoolExecutor(1) as pool:
        waiting: deque[Future[Batch]] = deque()
        try:
            for step in range(1, steps + 1):
                waiting.append(pool.submit(draw, np.random.default_rng([*draws, step])))
                if len(waiting) > ahead:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)
