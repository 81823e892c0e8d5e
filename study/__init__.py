"""A campaign from question to answer: manifest -> cases -> plan -> tasks -> results -> dataset -> report."""
