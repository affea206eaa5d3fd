"""Records: what the pair loop reads of a particle."""

import numpy as np
from oracles import (
    ALUMINIUM,
    SCHEME,
    cloud,
    pressure_and_sound_speed,
    sent_fields,
    table_of,
)

from mpisph.sph.neighbours import make_lattice, sort_into_cells
from mpisph.sph.pair_records import (
    RECORD_FIELDS,
    PairRecord,
    record_at,
    write_pair_records,
)
from mpisph.sph.sources import Sources, name_fields


def test_records_follow_the_fields_of_the_record():
    p = cloud(5, 33)
    p.r[0] = 1e-9
    cells = sort_into_cells(p.id, p.r, p.z, p.h, make_lattice(2e-3, 3.0))
    s = name_fields(sent_fields(p)[0])
    records = np.empty((5, RECORD_FIELDS))
    write_pair_records(s, cells.order, table_of(ALUMINIUM), SCHEME, records)
    ring = PairRecord(*records.T)
    s = Sources(*(field[cells.order] for field in s))
    P, c = np.array(
        [
            pressure_and_sound_speed(*state, ALUMINIUM, SCHEME)
            for state in zip(s.rho.tolist(), s.E.tolist(), strict=True)
        ]
    ).T
    assert len(ring) == RECORD_FIELDS
    for name in ("r", "z", "u_r", "u_z", "E"):
        np.testing.assert_array_equal(getattr(ring, name), getattr(s, name))
    closing = np.where(s.div < 0, 2 * np.abs(s.div), 0)
    s_tt = (P + s.S_rr + s.S_zz) * s.B_tt
    expected = {
        "half_h": 0.5 * s.h,
        "half_rho": 0.5 * s.rho,
        "V_F": -2.0 * s.m / s.rho / s.r**0.5,
        "eta": np.where(s.div < 0, 1.0, -1.0) * s.rho / 2710.0,
        "half_alpha_c": 0.5 * 2.5 * c,
        "two_zeta": s.h * c + 2.0 * s.h**2 * closing,
        "s_rr": (P - s.S_rr) * s.B_rr - s.S_rz * s.B_rz,
        "half_s_tr": 0.5 * (s_tt - (P - s.S_rr) * s.B_rr + s.S_rz * s.B_rz),
        "s_zz": (P - s.S_zz) * s.B_zz - s.S_rz * s.B_rz,
        "s_rz": (P - s.S_rr) * s.B_rz - s.S_rz * s.B_zz,
        "s_zr": (P - s.S_zz) * s.B_rz - s.S_rz * s.B_rr,
    }
    for name, want in expected.items():
        got = getattr(ring, name)
        scale = np.abs(want).max()
        np.testing.assert_allclose(got, want, rtol=1e-14, atol=1e-14 * scale)
    third = record_at(records, 3)
    assert third == tuple(records[3])
    assert third.two_zeta == ring.two_zeta[3]


def test_a_gas_r3_goes_by_mass_where_it_is_compressed_too():
    p = cloud(40, 34)
    cells = sort_into_cells(p.id, p.r, p.z, p.h, make_lattice(2e-3, 3.0))
    fields = name_fields(sent_fields(p)[0])
    gas = table_of(ALUMINIUM._replace(eos="ideal-gas", strength="none"))
    records = np.empty((p.n, RECORD_FIELDS))
    write_pair_records(fields, cells.order, gas, SCHEME, records)
    eta, div = fields.rho[cells.order] / ALUMINIUM.rho0, fields.div[cells.order]
    by_mass = (div < 0.0) | (eta > 1.0)
    assert 0 < by_mass.sum() < p.n
    assert (by_mass & (div > 0.0)).any()
    np.testing.assert_array_equal(
        PairRecord(*records.T).eta, np.where(by_mass, eta, -eta)
    )
