!> Groups of results files that name, label and scale each dataset by its quantity, such as time or displacement. This
!> module alone decides the name of a dataset, its unit, and the factor from dimensionless values to this unit.
module quantity_groups
   use hdf5_writing, only: hdf5_column_t, hdf5_group_t
   use kinds, only: wp
   use quantities, only: name_in_results, quantity_named, quantity_table, system_none, unit_of, units_t, words_in
   implicit none (type, external)
   private
   public :: quantity_group_t

   !> Name of the attribute of a dimensionless dataset with the unit in which the attribute `in_scene_units` is given.
   character(*), parameter :: scale_unit = 'scene_units'

   !> A group of a results file, with the units of its datasets. In its procedures `quantity` is a name in
   !> `quantity_table`, `meaning` the description of a dataset, and `along` the name of the dimension scale of its
   !> values.
   type, extends(hdf5_group_t) :: quantity_group_t
      !> Units of the results in the group
      type(units_t) :: units
      !> True: dimensionless values are given and the group scales them; false: values are given in the units of the
      !> file
      logical :: scales_values = .true.
      !> Whether the unit of a dimensionless dataset is the symbol of its quantity instead of 1
      logical :: symbols_as_units = .false.
   contains
      !> Make a subgroup
      procedure :: subgroup
      !> The same group, for values that need no scaling
      procedure :: unscaled
      !> Write a dataset: name, values (a number, a list or a table), quantity as in `quantity_table` (absent for
      !> integers), meaning. Of {a~b} in the meaning, a stands in dimensionless files and b in files with units. The
      !> argument `along` has the dimension scales of the indices, by their names in dimensionless files and separated
      !> by a blank; with `is_scale` the dataset is itself a dimension scale
      generic :: put => put_reals, put_integers
      !> Make a list or table that is filled later with values that need no scaling
      procedure :: put_column
      !> Show a list of another group as a table
      procedure :: put_view
      !> Write a numeric attribute
      procedure :: put_attribute
      !> Write the meanings of whole numbers
      procedure :: put_flags
      !> Name of a dataset in this file
      procedure, nopass :: named => name_in_results
      !> A text with each {a~b} replaced by a in dimensionless files and by b in files with units
      procedure :: resolved
      !> Unit of a quantity that is in units of the scene in every file
      procedure :: scene_unit
      procedure, private :: put_reals, put_integers, scales_named, find_unit, write_scale_unit
   end type quantity_group_t

contains

   !> Make a subgroup with the units of this group.
   type(quantity_group_t) function subgroup(self, name) result(made)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name

      made = self
      made%hdf5_group_t = self%group(name)
   end function subgroup

   !> The same group for values that need no scaling, such as values of several scenes. If these are dimensionless,
   !> or their scales differ, there is no attribute `in_scene_units`, because no single factor holds for all values.
   type(quantity_group_t) function unscaled(self, scales_vary) result(same)
      class(quantity_group_t), intent(in) :: self
      !> Whether the scenes differ in their scales, so that no factor converts all values; absent: they do not
      logical, intent(in), optional :: scales_vary

      same = self
      same%scales_values = .false.
      if (.not. same%units%are_physical) same%units%factor = 0.0_wp
      if (.not. present(scales_vary)) return
      if (scales_vary) same%units%factor = 0.0_wp
   end function unscaled

   !> Write numbers.
   subroutine put_reals(self, name, values, quantity, meaning, along, is_scale)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, intent(in) :: values(..)
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale

      character(:), allocatable :: unit
      real(wp) :: factor, scene_factor

      call self%find_unit(quantity, unit, factor, scene_factor)
      call self%add(self%named(name), values, unit, self%resolved(meaning), self%scales_named(along), is_scale, &
         scene_factor, factor)
      call self%write_scale_unit(name, quantity, scene_factor)
   end subroutine put_reals

   !> Write whole numbers.
   subroutine put_integers(self, name, values, meaning, along, is_scale)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, contiguous, intent(in) :: values(..)
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale

      call self%add(self%named(name), values, '1', self%resolved(meaning), self%scales_named(along), is_scale)
   end subroutine put_integers

   !> Names of one or two dimension scales in this file; empty: none is given.
   pure function scales_named(self, along) result(names)
      class(quantity_group_t), intent(in) :: self
      !> Names in dimensionless files, separated by a blank
      character(*), intent(in), optional :: along
      character(:), allocatable :: names

      integer :: blank

      names = ''
      if (.not. present(along)) return
      blank = index(trim(along), ' ')
      names = trim(adjustl(self%named(along(:blank - 1))//' '//self%named(along(blank + 1:))))
   end function scales_named

   !> Make a list whose values, or a table whose rows, are written later, in the unit of the list or table.
   type(hdf5_column_t) function put_column(self, name, extents, quantity, meaning, is_whole, along) result(made)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Number of values of a list; number of values in a row, and of rows, of a table
      integer, intent(in) :: extents(:)
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      logical, intent(in) :: is_whole
      !> Dimension scale of the values of a list, or of the rows of a table
      character(*), intent(in) :: along

      character(:), allocatable :: unit
      real(wp) :: factor, scene_factor

      call self%find_unit(quantity, unit, factor, scene_factor)
      made = self%column(self%named(name), extents, unit, self%resolved(meaning), is_whole, self%named(along), &
         in_scene_units=scene_factor)
      call self%write_scale_unit(name, quantity, scene_factor)
   end function put_column

   !> Show a list of another group as a table whose axes are dimension scales of this group (see `view` of
   !> `hdf5_writing`).
   subroutine put_view(self, name, source, extents, scales, quantity, meaning, is_whole)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Path of the group of the list
      character(*), intent(in) :: source
      !> Number of values along each axis, the last of which varies fastest
      integer, intent(in) :: extents(:)
      !> Name of the dimension scale of each axis
      character(*), intent(in) :: scales(:)
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      logical, intent(in) :: is_whole

      character(:), allocatable :: unit
      real(wp) :: factor, scene_factor

      call self%find_unit(quantity, unit, factor, scene_factor)
      call self%view(self%named(name), source, extents, scales, unit, self%resolved(meaning), is_whole, scene_factor)
   end subroutine put_view

   !> Write a numeric attribute of the group.
   subroutine put_attribute(self, name, value, quantity)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), intent(in) :: value
      character(*), intent(in) :: quantity

      character(:), allocatable :: unit
      real(wp) :: factor, scene_factor

      call self%find_unit(quantity, unit, factor, scene_factor)
      call self%attribute(self%named(name), value*factor)
   end subroutine put_attribute

   !> Write the meanings of the values of a dataset of whole numbers as the attributes `flag_values` and `flag_meanings`
   !> (CF conventions, section 3.5).
   subroutine put_flags(self, dataset, meanings, first)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: dataset
      !> One word for each of the successive values, with blanks between them
      character(*), intent(in) :: meanings
      !> Value of the first word; absent: 1
      integer, intent(in), optional :: first

      integer :: i, start, words

      start = 1
      if (present(first)) start = first
      words = count([(meanings(i:i) == ' ', i=1, len(meanings))]) + merge(1, 0, meanings /= '')
      call self%attribute('flag_values', [(i, i=start, start + words - 1)], dataset)
      call self%attribute('flag_meanings', meanings, dataset)
   end subroutine put_flags

   !> A text with each {a~b} replaced by a in dimensionless files and by b in files with units.
   pure function resolved(self, text)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: text
      character(:), allocatable :: resolved

      resolved = words_in(self%units, trim(text))
   end function resolved

   !> Unit of a quantity in units of the scene, whatever the units of the file.
   pure function scene_unit(self, quantity) result(unit)
      class(quantity_group_t), intent(in) :: self
      !> Empty for a pure number
      character(*), intent(in) :: quantity
      character(:), allocatable :: unit

      unit = '1'
      if (quantity /= '') unit = unit_of(quantity_named(quantity), self%units)
   end function scene_unit

   !> Unit and factors of a quantity in this group.
   pure subroutine find_unit(self, quantity, unit, factor, scene_factor)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: quantity
      !> Unit of the dataset
      character(:), allocatable, intent(out) :: unit
      !> Factor by which values are multiplied
      real(wp), intent(out) :: factor
      !> One dimensionless unit in units of the scene; 0: unknown, or a pure number
      real(wp), intent(out) :: scene_factor

      integer :: entry

      entry = quantity_named(quantity)
      unit = '1'
      if (self%symbols_as_units) unit = trim(quantity_table(entry)%symbol)
      factor = 1.0_wp
      scene_factor = 0.0_wp
      if (quantity == 'number') return
      scene_factor = self%units%factor(entry)
      if (.not. self%units%are_physical) return
      unit = unit_of(entry, self%units)
      if (self%scales_values) factor = scene_factor
   end subroutine find_unit

   !> Write the unit of the attribute `in_scene_units` of a dimensionless dataset, if the scene has a unit system.
   subroutine write_scale_unit(self, name, quantity, scene_factor)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: quantity
      !> One dimensionless unit in units of the scene; 0: unknown
      real(wp), intent(in) :: scene_factor

      if (self%units%are_physical .or. self%units%system == system_none .or. scene_factor <= 0.0_wp) return
      call self%attribute(scale_unit, unit_of(quantity_named(quantity), self%units), self%named(name))
   end subroutine write_scale_unit

end module quantity_groups
