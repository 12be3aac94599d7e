"""stub"""
def generate(name, family, number):
    raise NotImplementedError
