"""study.run"""
