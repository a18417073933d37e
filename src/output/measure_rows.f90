!> Measures of a run as a row of numbers, the same for a run of its own, a case of several and a case of a sweep.
module measure_rows
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use response_types, only: run_measures_t
   use sweep_settings, only: column_contacts, column_created, column_first_tau, column_first_velocity, column_force, &
      column_impacts, column_impulse, column_left, column_longest_contact, column_lost_beam, column_lost_impact, &
      column_lost_stop, column_peak, column_quiet, column_rebounds, column_spent, column_status, column_total_contact, &
      measure_count, measure_meanings, measure_names, measure_units, peak_columns
   implicit none (type, external)
   private
   public :: row_of, write_columns

   !> Columns that a file of one run or of several cases has under their own names.
   integer, parameter :: file_columns(9) = [column_force, column_impulse, column_total_contact, column_longest_contact, &
      column_lost_beam, column_lost_stop, column_lost_impact, column_created, column_left]

contains

   !> The row; what did not happen is NaN.
   pure function row_of(measures) result(row)
      !> The measures
      type(run_measures_t), intent(in) :: measures
      real(wp) :: row(measure_count)

      integer :: peaks

      row = ieee_value(1.0_wp, ieee_quiet_nan)
      row(column_status) = 0.0_wp
      row(column_impacts) = real(measures%impacts, wp)
      row(column_contacts) = real(size(measures%contact_start), wp)
      row(column_rebounds) = real(measures%rebounds, wp)
      if (measures%has_met_stop) then
         row(column_first_tau) = measures%first_impact_tau
         row(column_first_velocity) = measures%first_impact_velocity
      end if
      row(column_force) = measures%greatest_force
      row(column_impulse) = measures%greatest_impulse
      row(column_total_contact) = measures%total_contact
      row(column_longest_contact) = measures%longest_contact
      peaks = min(size(measures%peak_eta), peak_columns)
      row(column_peak:column_peak + peaks - 1) = measures%peak_eta(:peaks)
      if (measures%is_quiet) row(column_quiet) = measures%quiet_tau
      if (measures%has_spent) row(column_spent) = measures%spent_tau
      row(column_lost_beam) = measures%lost_beam
      row(column_lost_stop) = measures%lost_stop
      row(column_lost_impact) = measures%lost_impact
      row(column_created) = measures%created
      row(column_left) = measures%left
   end function row_of

   !> Those of `file_columns` into a group of a file.
   subroutine write_columns(group, rows, time, force, impulse, along)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> Rows, [measure_count, cases]; one without `along`
      real(wp), intent(in) :: rows(:, :)
      !> One unit of time, force and impulse in the units of the scene; 0: not known
      real(wp), intent(in) :: time
      real(wp), intent(in) :: force
      real(wp), intent(in) :: impulse
      !> Dimension scale of the cases
      character(*), intent(in), optional :: along

      real(wp) :: column(size(rows, 2)), unit
      integer :: i

      do i = 1, size(file_columns)
         associate (k => file_columns(i))
            column = rows(k, :)
            if (present(along)) then
               call group%add(trim(measure_names(k)), column, '1', trim(measure_meanings(k)), along=along)
               cycle
            end if
            call group%add(trim(measure_names(k)), column(1), '1', trim(measure_meanings(k)))
            select case (measure_units(k))
            case ('tau')
               unit = time
            case ('Pbar')
               unit = force
            case ('impulse')
               unit = impulse
            case default
               cycle
            end select
            if (unit > 0.0_wp) call group%note('in_scene_units', unit, trim(measure_names(k)))
         end associate
      end do
   end subroutine write_columns

end module measure_rows
