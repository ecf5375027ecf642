"""Every labelled equation of the paper, and what becomes of it here."""

from __future__ import annotations

PAPER = (
    "eq:genFilippov",
    "eq:genPerturbed",
    "eq:cont",
    "eq:genSDE",
    "eq:eekappar",
    "eq:Plarge",
    "eq:Psmall",
    "eq:Tdef",
    "eq:Tlarge",
    "eq:Tsmall",
    "eq:scaledSDE",
    "eq:scaledSDEx",
    "eq:phi",
    "eq:reducedSDE",
    "eq:tildexykappa",
    "eq:reducedSDEtilde",
    "eq:FPE",
    "eq:pss",
    "eq:V",
    "eq:V2",
    "eq:Ttildedef",
    "eq:tilder",
    "eq:BCs2",
    "eq:Ttilde0",
    "eq:Ttilde",
    "eq:C",
    "eq:P",
    "eq:P2",
    "eq:Plarge2",
    "eq:Psmall2",
    "eq:TtildeCzero",
    "eq:fourPieces",
    "eq:fourthTerm",
    "eq:Ttildelarge",
    "eq:secondTerm",
    "eq:fourthTerm2",
    "eq:Ttildesmall",
    "eq:S",
    "eq:TtildetoT",
    "eq:osc1",
    "eq:osc2",
    "eq:forcePWC",
    "eq:forcePerturbed",
    "eq:osc3",
    "eq:phifric0",
    "eq:Vfric",
    "cubic",
    "fr1",
    "fr2",
    "eq:odeR",
)

# Results without a label that carry weight, by the names given to them here.
UNLABELLED = (
    "filippov",
    "noise-amplitude",
    "regions",
    "first-integral",
    "density-R",
    "backward",
    "constant-drift",
    "tails",
    "L-bound",
    "C-bound",
    "first-three",
    "laplace-substitution",
    "gaussian-step",
    "other-pieces",
    "turning-points",
    "beta",
    "folds",
    "threshold",
)

# Labels with nothing to derive, and why.
REASONS = {
    "eq:genFilippov": "Definition of the discontinuous system; what follows from it at the "
    "surface is derived as 'filippov'.",
    "eq:genPerturbed": "Definition of the smoothed system; its one condition is eq:cont.",
    "eq:genSDE": "Definition of the system with noise; its component across the surface is "
    "eq:scaledSDEx.",
    "eq:Tdef": "Definition of the mean escape time; its scaled form is computed in eq:Ttilde0.",
    "eq:Ttildedef": "Definition of the scaled mean escape time; eq:Ttilde0 and 'backward' "
    "compute it.",
    "eq:BCs2": "Definition of the problem: the start at 0 and absorption at both ends; used in "
    "eq:odeR, density-R and eq:C.",
    "eq:osc1": "Definition of the model; eq:osc2 is derived from it.",
}
